"""The sink ``ros2``: a ROS 2 node of its own, where rclpy is installed."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from tomoskin.core import SinkError
from tomoskin.sink.consumer import options_of
from tomoskin.sink.naming import Naming
from tomoskin.sink.ros import TOPICS, RosView
from tomoskin.sink.sink import Item, Stream

_DEPTH = 10
"""Messages that a publisher keeps for slow subscribers."""

Value = Mapping[str, Any]


class Ros2Sink:
    """Publishes by ``rclpy``, which comes with a ROS 2 installation and not from the registry."""

    def __init__(self, naming: Naming) -> None:
        self.name = f"ros2 /{naming.namespace}"
        self._naming = naming
        try:
            self._rclpy: Any = importlib.import_module("rclpy")
        except ImportError as error:
            raise SinkError(
                f"needs ROS 2's rclpy: {error}",
                where="sink ros2",
                hint="source ROS 2's setup.bash first; without ROS 2 there is --sink zenoh",
            ) from error
        self._kinds = {topic: _message_class(kind) for topic, kind in TOPICS.items()}
        self._context: Any = None
        self._node: Any = None

    def open(self, stream: Stream) -> None:
        """Start a node in a context of its own, which takes no signals."""
        self._context = self._rclpy.Context()
        self._rclpy.init(args=[], context=self._context)
        self._node = self._rclpy.create_node(
            "tomoskin", context=self._context, namespace=f"/{self._naming.namespace}"
        )
        self._view = RosView(stream, self._naming)
        self._publishers = {
            topic: self._node.create_publisher(kind, topic, _DEPTH)
            for topic, kind in self._kinds.items()
        }

    def publish(self, item: Item) -> None:
        """Send the messages of ``item``."""
        for message in self._view.of(item):
            filled = _filled(self._kinds[message.topic](), message.value)
            self._publishers[message.topic].publish(filled)

    def close(self) -> None:
        """End the node."""
        node, context = self._node, self._context
        self._node = self._context = None
        if node is not None:
            node.destroy_node()
        if context is not None:
            self._rclpy.shutdown(context=context)


def open_ros2(argument: str) -> Ros2Sink:
    """``ros2``, ``ros2:namespace=NAME,frame=NAME``; SinkError for others, or without rclpy."""
    where = "sink ros2"
    words = filter(None, argument.split(","))
    return Ros2Sink(Naming.of(options_of(words, ("namespace", "frame"), where), where))


def _message_class(kind: str) -> Any:
    package, _, name = kind.rpartition("/")
    return getattr(importlib.import_module(package.replace("/", ".")), name)


def _filled(message: Any, value: Value) -> Any:
    for name, part in value.items():
        if isinstance(part, Mapping):
            _filled(getattr(message, name), part)
        else:
            setattr(message, name, part)
    return message
