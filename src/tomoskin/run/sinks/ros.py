"""Results as messages of ROS 2, by topic."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from tomoskin.core import Event, Image, encode_json
from tomoskin.run.sinks import ros_messages
from tomoskin.run.sinks.contact import Contacts, event_content
from tomoskin.run.sinks.naming import Naming
from tomoskin.run.sinks.ros_messages import Value
from tomoskin.run.sinks.sink import HEARTBEAT, Item, Moment, Stream, TouchPace

POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
IMAGE = "sensor_msgs/msg/Image"
TEXT = "std_msgs/msg/String"

TOPICS = {
    "touch": POSE,
    "track": ODOMETRY,
    "touches": TEXT,
    "contacts": "tactile_msgs/msg/TactileContacts",
    "wrench": "geometry_msgs/msg/WrenchStamped",
    "markers": "visualization_msgs/msg/MarkerArray",
    "image": IMAGE,
    "points": "sensor_msgs/msg/PointCloud2",
    "events": TEXT,
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}
"""Type of each topic, by its name in the skin's namespace; with "/": of the whole robot."""

KEPT = frozenset({"/tf_static"})
"""Topics whose last message is for those too who come later."""


@dataclass(frozen=True, slots=True)
class RosMessage:
    """A message for ``topic`` (of :data:`TOPICS`), its fields by name; ``stamp`` ns since 1970."""

    topic: str
    value: Value
    stamp: int


class RosView:
    """Turns results and events into messages."""

    def __init__(self, stream: Stream, naming: Naming) -> None:
        self._stream, self._naming = stream, naming
        self._pace = TouchPace()
        self._reported = float("-inf")
        self._valid: bool | None = None

    def of(self, item: Item) -> Iterator[RosMessage]:
        """Messages of one frame, or of an event."""
        stamp = self._stream.log_time(item.host_time)
        of_frame = not isinstance(item, Event)
        for event in (item,) if isinstance(item, Event) else item.messages:
            content = event_content(self._stream, self._naming, event, of_frame=of_frame)
            yield RosMessage("events", _json(content), stamp)
        if isinstance(item, Event):
            return
        for topic, value in self._of_frame(item, stamp):
            yield RosMessage(topic, value, stamp)

    def _of_frame(self, moment: Moment, stamp: int) -> Iterator[tuple[str, Value]]:
        head = ros_messages.header(stamp, self._naming.frame_id)
        touching, reporting = self._pace.is_due(moment), self._report_is_due(moment)
        if touching or reporting:
            contacts = Contacts.of(self._stream, self._naming, moment)
        if touching:
            yield from _touches(head, contacts)
        if moment.image is not None:
            yield from self._images(head, moment.image)
        if reporting:
            yield "/diagnostics", ros_messages.diagnostics(head, contacts, self._naming.namespace)
            if self._naming.mount is not None:
                frame, mount = self._naming.frame_id, self._naming.mount
                yield "/tf_static", ros_messages.transform(stamp, frame, mount)

    def _images(self, head: Value, image: Image) -> Iterator[tuple[str, Value]]:
        if self._stream.pixels is not None:
            yield "image", ros_messages.image(head, image, self._stream.pixels)
        if self._stream.points is not None:
            yield "points", ros_messages.points(head, image, self._stream.points)

    def _report_is_due(self, moment: Moment) -> bool:
        """Once a second, and where touches become valid or no longer are."""
        waited = moment.host_time - self._reported
        if moment.valid is self._valid and 0 <= waited < HEARTBEAT:
            return False
        self._valid, self._reported = moment.valid, moment.host_time
        return True


def _touches(head: Value, contacts: Contacts) -> Iterator[tuple[str, Value]]:
    """Each touch as a pose and as a track, which has its identity; then all of them."""
    for contact in contacts.touches:
        yield "touch", {"header": head, "pose": ros_messages.pose(contact)}
        yield "track", ros_messages.track(head, contact)
    yield "touches", _json(contacts.content())
    yield "contacts", ros_messages.contacts(head, contacts)
    yield "wrench", ros_messages.wrench(head, contacts)
    yield "markers", ros_messages.markers(head, contacts)


def _json(content: Mapping[str, Any]) -> Value:
    return {"data": encode_json(content).decode()}
