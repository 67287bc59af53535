"""Publishes how a robot stands as a node of ROS 2 does: the seconds of the day, as an angle.

Its type is that of a library of others (``rosbags``); nothing of tomoskin is imported.

    python joint_publisher.py DOMAIN TOPIC
"""

import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from ros_peer import struct_of  # type: ignore[import-not-found]

QOS = Qos(
    Policy.Reliability.Reliable(10**9),
    Policy.History.KeepLast(10),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


def main():
    """Publish 50 states a second until the process is ended."""
    state, stamp, header = (
        struct_of(f"{package}/msg/{name}")
        for package, name in (
            ("sensor_msgs", "JointState"), ("builtin_interfaces", "Time"), ("std_msgs", "Header"),
        )
    )  # fmt: skip
    participant = DomainParticipant(int(sys.argv[1]))
    writer = DataWriter(participant, Topic(participant, sys.argv[2], state), qos=QOS)
    while True:
        now = time.time()
        about = header(stamp(int(now), int(now % 1 * 1e9)), "")
        writer.write(state(about, ["shoulder"], [now % 100], [], []))
        time.sleep(0.02)


if __name__ == "__main__":
    main()
