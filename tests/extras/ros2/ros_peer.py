"""A participant of another process that sees what a ROS 2 node would, and says so as JSON lines.

Its types are those of a library of others (``rosbags``), made into CycloneDDS' own; nothing of
tomoskin is imported. A first line for each topic that appears: its type, the user data and the
durability; then one for each message.

    python ros_peer.py DOMAIN
"""

from __future__ import annotations

import functools
import json
import sys
import time
from dataclasses import asdict, is_dataclass

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import make_idl_struct, types
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(
    get_types_from_msg(
        "std_msgs/Header header\nstring name\ngeometry_msgs/Point position\n"
        "geometry_msgs/Vector3 normal\ngeometry_msgs/Wrench wrench",
        "tactile_msgs/msg/TactileContact",
    )
)
STORE.register(
    get_types_from_msg("tactile_msgs/TactileContact[] contacts", "tactile_msgs/msg/TactileContacts")
)
NUMBERS = {"octet": types.byte, "char": types.uint8, "bool": bool, "string": str}


@functools.cache
def struct_of(kind):
    """CycloneDDS' class of a ROS 2 message."""
    package, name = kind.replace("/", ".").rsplit(".", 1)
    fields = {key: type_of(text) for key, text in STORE.fielddefs[kind][1]}
    return make_idl_struct(f"{name}_", f"{package}.dds_.{name}_", fields)


def type_of(text):
    """Of a field, as the library writes it: (node, what)."""
    node, what = int(text[0]), text[1]
    if node == 1:
        return NUMBERS.get(what[0]) or getattr(types, what[0])
    if node == 2:
        return struct_of(what)
    inner, length = type_of(what[0]), what[1]
    return types.array[inner, length] if node == 3 else types.sequence[inner]


def kind_of(type_name):
    """``a::msg::dds_::B_`` → ``a/msg/B``."""
    return type_name.replace("::dds_", "").removesuffix("_").replace("::", "/")


def plain(value):
    """As JSON takes it."""
    if is_dataclass(value):
        return asdict(value)
    return list(value)


def main():
    """Listen until the process is ended."""
    participant = DomainParticipant(int(sys.argv[1]))
    publications = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)
    readers = {}
    while True:
        for found in publications.take(N=100):
            name = found.topic_name
            if not found.sample_info.valid_data or name in readers or not name.startswith("rt/"):
                continue
            qos = found.qos
            kept = qos[Policy.Durability] == Policy.Durability.TransientLocal
            topic = Topic(participant, name, struct_of(kind_of(found.type_name)))
            wanted = (
                Qos(Policy.Reliability.Reliable(0), Policy.Durability.TransientLocal)
                if kept
                else (Qos(Policy.Reliability.Reliable(0)))
            )
            readers[name] = DataReader(participant, topic, qos=wanted)
            data = qos[Policy.Userdata].data.decode()
            say(topic=name, type=found.type_name, data=data, kept=kept)
        for name, reader in readers.items():
            for message in reader.take(N=100):
                if message.sample_info.valid_data:
                    stamp = message.sample_info.source_timestamp
                    say(heard=name, value=asdict(message), stamp=stamp)
        time.sleep(0.02)


def say(**line):
    """One line."""
    sys.stdout.write(json.dumps(line, default=plain) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
