"""What happens on a skin as standard ROS 2 messages, for whatever carries them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from tomoskin.core import Event, Image, PixelMap, Touch
from tomoskin.recording import touches_message
from tomoskin.sink.pace import TouchPace
from tomoskin.sink.sink import Item, Moment, Stream

FRAME = "skin"
"""Name of the sheet's own frame of coordinates: x right, y up, seen from the front; m."""

POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
IMAGE = "sensor_msgs/msg/Image"
TEXT = "std_msgs/msg/String"

TOPICS = {
    "tomoskin/touch": POSE,
    "tomoskin/touches": TEXT,
    "tomoskin/image": IMAGE,
    "tomoskin/events": TEXT,
}
"""Type of each topic."""

_UNKNOWN = 1e6
"""Variance of what is not measured, m² or rad²: what filters take for no knowledge."""

Value = dict[str, Any]


@dataclass(frozen=True, slots=True)
class RosMessage:
    """A message for ``topic``, its fields by name, of the time ``stamp`` in ns since 1970."""

    topic: str
    value: Value
    stamp: int


class RosView:
    """Turns results and events into messages."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        self._pace = TouchPace()

    def of(self, item: Item) -> Iterator[RosMessage]:
        """Messages of one frame, or of an event."""
        stamp = self._stream.log_time(item.host_time)
        for event in (item,) if isinstance(item, Event) else item.told:
            content = {"time_s": event.host_time, "kind": event.kind, "text": event.text}
            yield RosMessage("tomoskin/events", _json(content), stamp)
        if isinstance(item, Event):
            return
        if self._pace.is_due(item):
            for touch in item.touches:
                yield RosMessage("tomoskin/touch", _pose(touch, stamp), stamp)
            yield RosMessage("tomoskin/touches", _json(_touches(item)), stamp)
        if item.image is not None and self._stream.pixels is not None:
            yield RosMessage(
                "tomoskin/image", _image(item.image, self._stream.pixels, stamp), stamp
            )


def _touches(moment: Moment) -> dict[str, Any]:
    return touches_message(moment.host_time, moment.sequence, moment.touches)


def _json(content: Any) -> Value:
    return {"data": msgspec.json.encode(content).decode()}


def _header(stamp: int) -> Value:
    sec, nanosec = divmod(stamp, 1_000_000_000)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": FRAME}


def _pose(touch: Touch, stamp: int) -> Value:
    """Place in the sheet's plane; what an image does not say has a vast variance."""
    detection = touch.detection
    variance = np.array([detection.sd_x**2, detection.sd_y**2, *[_UNKNOWN] * 4])
    covariance = np.diag(np.where(np.isfinite(variance), variance, _UNKNOWN))
    if np.isfinite(variance).all():
        covariance[[0, 1], [1, 0]] = detection.cov_xy
    pose = {
        "position": {"x": detection.x, "y": detection.y, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }
    return {"header": _header(stamp), "pose": {"pose": pose, "covariance": covariance.ravel()}}


def _image(image: Image, pixels: PixelMap, stamp: int) -> Value:
    """Change of conductivity as 32-bit floats, the top row first, NaN outside the sheet."""
    values = image.on_pixels(pixels).astype("<f4")
    height, width = values.shape
    return {
        "header": _header(stamp),
        "height": height,
        "width": width,
        "encoding": "32FC1",
        "is_bigendian": 0,
        "step": 4 * width,
        "data": values.tobytes(),
    }
