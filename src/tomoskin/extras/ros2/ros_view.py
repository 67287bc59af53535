"""What leaves the program as messages of ROS 2, by topic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from tomoskin.core import Event, Image, encode_json
from tomoskin.extras.ros2 import ros_fields
from tomoskin.extras.ros2.ros_fields import Value
from tomoskin.files.messages import Contacts, Item, Stream, event_content, row_labels, time_of

POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
ODOMETRY = "nav_msgs/msg/Odometry"
IMAGE = "sensor_msgs/msg/Image"
TEXT = "std_msgs/msg/String"

TOPICS = {
    "touch": POSE,
    "track": ODOMETRY,
    "touches": TEXT,
    "valid": "std_msgs/msg/Bool",
    "contacts": "tactile_msgs/msg/TactileContacts",
    "wrench": "geometry_msgs/msg/WrenchStamped",
    "markers": "visualization_msgs/msg/MarkerArray",
    "image": IMAGE,
    "points": "sensor_msgs/msg/PointCloud2",
    "voltages": "std_msgs/msg/Float32MultiArray",
    "rows": TEXT,
    "events": TEXT,
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}
"""Type of each topic, by its name in the skin's namespace; with "/": of the whole robot."""

KEPT = frozenset({"rows", "/tf_static"})
"""Topics whose last message is for those too who come later."""


@dataclass(frozen=True, slots=True)
class RosMessage:
    """A message for ``topic`` (of :data:`TOPICS`); ``stamp`` ns since 1970."""

    topic: str
    make: Callable[[], Value]
    stamp: int

    @property
    def value(self) -> Value:
        """Its fields by name, made now: who has no reader of the topic saves most of the cost."""
        return self.make()


def ros_messages(stream: Stream, item: Item) -> Iterator[RosMessage]:
    """Messages of one frame, or of an event."""
    frame = None if isinstance(item, Event) else item
    stamp = stream.log_time(time_of(item))
    for event in (item,) if isinstance(item, Event) else item.events:
        content = partial(event_content, stream, event, frame)
        yield RosMessage("events", partial(_json, content), stamp)
    if isinstance(item, Event):
        return
    head = ros_fields.header(stamp, item.frame_id)
    for topic, make in _of_frame(head, item, stamp):
        yield RosMessage(topic, make, stamp)


Made = Iterator[tuple[str, Callable[[], Value]]]


def _of_frame(head: Value, contacts: Contacts, stamp: int) -> Made:
    stream = contacts.stream
    if contacts.is_due:
        yield from _touches(head, contacts)
    if contacts.voltages is not None:
        yield "voltages", partial(ros_fields.voltages, contacts)
    if contacts.image is not None:
        yield from _images(head, stream, contacts.image)
    if contacts.reports:
        naming = stream.naming
        yield "rows", partial(_json, lambda: {"measurements": row_labels(stream.pattern)})
        yield "/diagnostics", partial(ros_fields.diagnostics, head, contacts)
        if (mount := naming.mount) is not None:
            yield "/tf_static", partial(ros_fields.transform, stamp, naming.frame_id, mount)


def _images(head: Value, stream: Stream, image: Image) -> Made:
    if stream.pixels is not None:
        yield "image", partial(ros_fields.image, head, image, stream.pixels)
    if stream.points is not None:
        yield "points", partial(ros_fields.points, head, image, stream.points)


def _touches(head: Value, contacts: Contacts) -> Made:
    """All touches, which a robot acts on; then each as a pose and as a track, which has its
    identity and a frame.

    Where touches are not valid there are no contacts, not even none.
    """
    yield "touches", partial(_json, contacts.content)
    yield "valid", lambda: {"data": contacts.valid}
    if contacts.valid:
        yield "contacts", partial(ros_fields.contacts, head, contacts)
    yield "wrench", partial(ros_fields.wrench, head, contacts)
    for contact in contacts.touches:
        yield "touch", partial(ros_fields.stamped_pose, head, contact)
        yield "track", partial(ros_fields.track, head, contact)
    if contacts.touches:
        yield "/tf", partial(ros_fields.touch_frames, head, contacts)
    yield "markers", partial(ros_fields.markers, head, contacts)


def _json(content: Callable[[], Mapping[str, Any]]) -> Value:
    return {"data": encode_json(content()).decode()}
