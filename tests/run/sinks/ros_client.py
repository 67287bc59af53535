"""Asks a service of ``std_srvs/srv/Trigger`` as a node of ROS 2 by ``rmw_cyclonedds`` does.

Nothing of tomoskin is imported: topics, types and the head of each message are written as that
middleware has them.

    python ros_client.py DOMAIN /NAMESPACE/SERVICE
"""

import json
import sys
import time
from dataclasses import asdict, dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int64, uint8, uint64
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

NUMBER = 7
QOS = Qos(
    Policy.Reliability.Reliable(10**9),
    Policy.History.KeepLast(10),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


@dataclass
class Request(IdlStruct, typename="std_srvs.srv.dds_.Trigger_Request_"):
    guid: uint64
    seq: int64
    structure_needs_at_least_one_member: uint8


@dataclass
class Reply(IdlStruct, typename="std_srvs.srv.dds_.Trigger_Response_"):
    guid: uint64
    seq: int64
    success: bool
    message: str


def user_data(endpoint):
    return endpoint.qos[Policy.Userdata].data.decode()


def main():
    """Ask once, and print the reply that is for us; then what both ends of the service said."""
    participant, service = DomainParticipant(int(sys.argv[1])), sys.argv[2]
    reader = DataReader(participant, Topic(participant, f"rr{service}Reply", Reply), qos=QOS)
    writer = DataWriter(participant, Topic(participant, f"rq{service}Request", Request), qos=QOS)
    while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
        time.sleep(0.02)  # as wait_for_service
    ends = [
        *map(writer.get_matched_subscription_data, writer.get_matched_subscriptions()),
        *map(reader.get_matched_publication_data, reader.get_matched_publications()),
    ]
    mine = writer.get_instance_handle() % 2**64
    writer.write(Request(mine, NUMBER, 0))
    for reply in reader.take_iter():
        if (reply.guid, reply.seq) == (mine, NUMBER):
            line = asdict(reply) | {"ends": [user_data(end) for end in ends]}
            sys.stdout.write(json.dumps(line) + "\n")
            return


if __name__ == "__main__":
    main()
