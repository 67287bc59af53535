"""Messages in Foxglove's own schemas: a log line, a grid, a scene of touches.

https://docs.foxglove.dev/docs/visualization/message-schemas describes them; each carries the
exact host time beside its fields.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import CHANGE, Event, Image, PixelMap, Touch
from tomoskin.files.messages.contacts import Contact

_INFO, _WARNING = 2, 3
_QUIET = frozenset(
    {"connected", "resumed", "note", "recording", "recorded"}
    | {f"touch-{kind}" for kind in ("onset", "move", "release", "merge", "split")}
)
"""Kinds of events that no one has to act on."""

_FLOAT32 = 7
_FRAME = "skin"
TEXT_HEIGHT = 8e-3
"""Height of a touch's number, m."""

TEXT_COLOUR = {"r": 0.5, "g": 0.5, "b": 0.5, "a": 1.0}
_UPRIGHT = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}

_UNUSED = ("arrows", "cubes", "cylinders", "lines", "triangles", "models")
"""Kinds of primitives that an entity of a scene must have a list of, and ours leave empty."""

Message = dict[str, Any]


def _see_through(levels: NDArray[np.uint8]) -> dict[str, float]:
    return dict(zip("rgba", (*(levels / 255).tolist(), 0.8), strict=True))


_FALL, _RISE = _see_through(CHANGE.table[0]), _see_through(CHANGE.table[-1])


def touch_colour(touch: Touch) -> dict[str, float]:
    """R, g, b and a from 0 to 1: blue for a fall, red for a rise, slightly transparent."""
    return _RISE if touch.kind == "increase" else _FALL


def touch_width(touch: Touch) -> float:
    """Diameter of a disc of the touch's area, m."""
    return 2.0 * math.sqrt(touch.detection.area / math.pi)


def log_message(event: Event, log_time: int) -> Message:
    """A ``foxglove.Log`` of an event or note."""
    return {
        "timestamp": _timestamp(log_time),
        "level": _INFO if event.kind in _QUIET else _WARNING,
        "message": event.text,
        "name": event.kind,
        "file": "",
        "line": 0,
        "host_time": event.host_time,
    }


def grid_message(image: Image, pixels: PixelMap, host_time: float, log_time: int) -> Message:
    """A ``foxglove.Grid`` of one image: a 32-bit float a pixel, NaN outside the sheet.

    Its rows begin at the lowest y, where the grid's own place is.
    """
    values = image.on_pixels(pixels)[::-1].astype("<f4")
    columns = values.shape[1]
    size = _size(pixels)
    return {
        "timestamp": _timestamp(log_time),
        "frame_id": _FRAME,
        "pose": _pose(float(pixels.x[0]) - size / 2, float(pixels.y[-1]) - size / 2),
        "column_count": columns,
        "cell_size": {"x": size, "y": size},
        "row_stride": 4 * columns,
        "cell_stride": 4,
        "fields": [{"name": "change", "offset": 0, "type": _FLOAT32}],
        "data": base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii"),
        "host_time": host_time,
        "unit": image.unit,
    }


def scene_message(contacts: Sequence[Contact], log_time: int) -> Message:
    """A ``foxglove.SceneUpdate`` that shows these touches in space, and no others."""
    now = _timestamp(log_time)
    return {
        "deletions": [{"timestamp": now, "type": 1, "id": ""}],
        "entities": [_entity(contact, now) for contact in contacts],
    }


def _size(pixels: PixelMap) -> float:
    """Side of a pixel, m; 1 mm where there is only one."""
    several = next((line for line in (pixels.x, pixels.y) if len(line) > 1), None)
    return 1e-3 if several is None else abs(float(several[1] - several[0]))


def _entity(contact: Contact, now: dict[str, int]) -> Message:
    touch, pose = contact.touch, _pose(*contact.position)
    width = touch_width(touch)
    return {
        "timestamp": now,
        "frame_id": _FRAME,
        "id": f"touch-{touch.id}",
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": True,
        "metadata": [
            {"key": "kind", "value": touch.kind},
            {"key": "peak", "value": f"{touch.detection.peak:.4g}"},
        ],
        **{kind: [] for kind in _UNUSED},
        "spheres": [
            {"pose": pose, "size": {"x": width, "y": width, "z": 0.2 * width},
             "color": touch_colour(touch)}
        ],
        "texts": [
            {"pose": pose, "billboard": True, "font_size": TEXT_HEIGHT, "scale_invariant": False,
             "color": TEXT_COLOUR, "text": str(touch.id)}
        ],
    }  # fmt: skip


def _pose(x: float, y: float, z: float = 0.0) -> Message:
    return {"position": {"x": x, "y": y, "z": z}, "orientation": _UPRIGHT}


def _timestamp(log_time: int) -> dict[str, int]:
    sec, nsec = divmod(log_time, 1_000_000_000)
    return {"sec": sec, "nsec": nsec}
