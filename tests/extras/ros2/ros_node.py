"""A node of ROS 2, by its own library ``rclpy`` on Fast DDS: it says as JSON lines what it hears.

Nothing of tomoskin is imported. A first line for each topic that appears: its type, the hash of
that and the node that publishes it; then one for each message, as ROS 2 prints it.

    python ros_node.py TOPIC ...
"""

import importlib
import json
import sys

import rclpy  # type: ignore[import-not-found]
from rclpy.node import Node  # type: ignore[import-not-found]

DEPTH, PATIENCE = 10, 0.05


def main():
    """Subscribe to each topic when it appears, and say what comes."""
    rclpy.init()
    node, wanted = Node("listener"), set(sys.argv[1:])
    while True:
        for topic, kinds in node.get_topic_names_and_types():
            if topic not in wanted:
                continue
            of = node.get_publishers_info_by_topic(topic)
            if of and of[0].node_name in node.get_node_names():  # its graph may come later
                wanted.discard(topic)
                say(
                    topic=topic,
                    type=kinds[0],
                    node=of[0].node_name,
                    hash=str(of[0].topic_type_hash),
                )
                node.create_subscription(kind_of(kinds[0]), topic, heard(topic), DEPTH)
        rclpy.spin_once(node, timeout_sec=PATIENCE)


def kind_of(name):
    """``a/msg/B`` → its class."""
    package, folder, kind = name.split("/")
    return getattr(importlib.import_module(f"{package}.{folder}"), kind)


def heard(topic):
    """What is called with each message of a topic."""
    return lambda message: say(heard=topic, value=plain(message))


def plain(value):
    """A message as plain values."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, bytes):
        return value[0]
    return [plain(item) for item in value]


def say(**line):
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
