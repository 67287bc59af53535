"""Sees the nodes of a domain as ``ros2 node list`` and ``ros2 node info`` do, and says so as JSON.

Its types are those of a library of others (``rosbags``), of the release that is named; nothing of
tomoskin is imported. One line for each message of a participant that has a node.

    python ros_graph.py DOMAIN ROS2_HUMBLE
"""

import json
import sys
import time

import ros_peer  # type: ignore[import-not-found]
from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from rosbags.typesys import Stores, get_typestore

QOS = Qos(Policy.Reliability.Reliable(10**9), Policy.Durability.TransientLocal)


def main():
    """Listen until the process is ended."""
    ros_peer.STORE = get_typestore(Stores[sys.argv[2]])
    participant = DomainParticipant(int(sys.argv[1]))
    info = ros_peer.struct_of("rmw_dds_common/msg/ParticipantEntitiesInfo")
    reader = DataReader(participant, Topic(participant, "ros_discovery_info", info), qos=QOS)
    builtin = [
        BuiltinDataReader(participant, kind)
        for kind in (BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription)
    ]
    names, messages = {}, []
    while True:
        for end in (end for ends in builtin for end in ends.take(N=200)):
            if end.sample_info.valid_data:
                names[end.key.bytes] = end.topic_name, end.participant_key.bytes
        messages += [m for m in reader.take(N=10) if m.sample_info.valid_data]
        for message in messages:
            for node in message.node_entities_info_seq:
                gids = [*node.reader_gid_seq, *node.writer_gid_seq]
                ends = [names.get(bytes(gid.data[:16]), ("", b"")) for gid in gids]
                owner = bytes(message.gid.data[:16])
                line = {
                    "node": [node.node_namespace, node.node_name],
                    "size": len(message.gid.data),
                    "topics": [name for name, _ in ends],
                    "own": all(key == owner for _, key in ends),
                }
                sys.stdout.write(json.dumps(line) + "\n")
                sys.stdout.flush()
        time.sleep(0.1)


if __name__ == "__main__":
    main()
