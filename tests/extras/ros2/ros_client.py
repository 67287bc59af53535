"""Calls a service as a node of ROS 2 by ``rmw_cyclonedds`` does, with types of ``rosbags``.

Nothing of tomoskin is imported: topics, types and the head of each message are written as that
middleware has them, in a file for each service.

    python ros_client.py DOMAIN /NAMESPACE/SERVICE PACKAGE/TYPE '{"names": ["skin"]}'
"""

import json
import sys
import time
from dataclasses import asdict

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from ros_peer import struct_of  # type: ignore[import-not-found]

NUMBER = 7
QOS = Qos(
    Policy.Reliability.Reliable(10**9),
    Policy.History.KeepLast(10),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
STRINGS, MESSAGES = types.sequence[str], "rcl_interfaces/msg"
SERVICES = {
    "std_srvs/Trigger": (
        {"structure_needs_at_least_one_member": types.uint8}, {"success": bool, "message": str},
    ),
    "rcl_interfaces/ListParameters": (
        {"prefixes": STRINGS, "depth": types.uint64},
        {"result": struct_of(f"{MESSAGES}/ListParametersResult")},
    ),
    "rcl_interfaces/GetParameters": (
        {"names": STRINGS}, {"values": types.sequence[struct_of(f"{MESSAGES}/ParameterValue")]},
    ),
    "rcl_interfaces/DescribeParameters": (
        {"names": STRINGS},
        {"descriptors": types.sequence[struct_of(f"{MESSAGES}/ParameterDescriptor")]},
    ),
    "rcl_interfaces/SetParameters": (
        {"parameters": types.sequence[struct_of(f"{MESSAGES}/Parameter")]},
        {"results": types.sequence[struct_of(f"{MESSAGES}/SetParametersResult")]},
    ),
}  # fmt: skip
"""What each type of service asks and replies."""

HEAD = {"guid": types.uint64, "seq": types.int64}
"""What comes first in every request and reply."""


def struct(kind, part, fields):
    package, _, name = f"{kind}_{part}".rpartition("/")
    return make_idl_struct(f"{name}_", f"{package}.srv.dds_.{name}_", HEAD | fields)


def user_data(endpoint):
    return endpoint.qos[Policy.Userdata].data.decode()


def parameter(name, text):
    """A parameter whose value is a text."""
    value = struct_of(f"{MESSAGES}/ParameterValue")
    return struct_of(f"{MESSAGES}/Parameter")(
        name, value(4, False, 0, 0.0, text, [], [], [], [], [])
    )


def main():
    """Ask once, and print the reply that is for us; then what both ends of the service said."""
    domain, service, kind, asked = int(sys.argv[1]), *sys.argv[2:4], json.loads(sys.argv[4])
    if "parameters" in asked:
        asked["parameters"] = [parameter(*named) for named in asked["parameters"].items()]
    participant = DomainParticipant(domain)
    request, reply = (
        struct(kind, part, fields)
        for part, fields in zip(("Request", "Response"), SERVICES[kind], strict=True)
    )
    reader = DataReader(participant, Topic(participant, f"rr{service}Reply", reply), qos=QOS)
    writer = DataWriter(participant, Topic(participant, f"rq{service}Request", request), qos=QOS)
    while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
        time.sleep(0.02)  # as wait_for_service
    ends = [
        *map(writer.get_matched_subscription_data, writer.get_matched_subscriptions()),
        *map(reader.get_matched_publication_data, reader.get_matched_publications()),
    ]
    mine = writer.get_instance_handle() % 2**64
    writer.write(request(guid=mine, seq=NUMBER, **asked))
    for got in reader.take_iter():
        if (got.guid, got.seq) == (mine, NUMBER):
            line = asdict(got) | {"ends": [user_data(end) for end in ends]}
            sys.stdout.write(json.dumps(line, default=list) + "\n")
            return


if __name__ == "__main__":
    main()
