"""Messages of ours as plain values and back, and how plain values become JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from tomoskin.core import Detection, Event, Touch

_NO_CELLS = np.empty(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class Truth:
    """What pressed on the twin from ``host_time`` on, and how it was bent: fields by name."""

    host_time: float
    presses: tuple[dict[str, Any], ...]
    bends: tuple[dict[str, Any], ...] = ()


@dataclass(frozen=True, slots=True)
class RecordedTouches:
    """Touches of the frame ``sequence``; which cells they covered is not in the file."""

    host_time: float
    sequence: int
    touches: tuple[Touch, ...]


def encode_json(content: Mapping[str, Any]) -> bytes:
    """JSON whose numbers come back to the bit; what is not finite becomes null."""
    return msgspec.json.encode(content, enc_hook=_number)


def plain(item: Any) -> dict[str, Any]:
    """A mapping or a record as plain values by name."""
    if isinstance(item, Mapping):
        return dict(item)
    found: dict[str, Any] = msgspec.to_builtins(item, enc_hook=_number)
    return found


def touches_message(host_time: float, sequence: int, touches: Sequence[Touch]) -> dict[str, Any]:
    """A ``tomoskin.Touches``: those of the frame ``sequence``; m, m², the image's unit."""
    rows = [touch_row(touch) for touch in touches]
    return {"host_time": host_time, "sequence": sequence, "touches": rows}


def touch_row(touch: Touch) -> dict[str, Any]:
    """One touch as plain values by name."""
    r = touch.detection
    return {
        "id": touch.id, "kind": touch.kind, "since": touch.since,
        "x": r.x, "y": r.y, "sd_x": r.sd_x, "sd_y": r.sd_y, "area": r.area, "peak": r.peak,
        "cov_xy": r.cov_xy, "close": r.close, "merged": touch.merged,
    }  # fmt: skip


def touches_of(content: Mapping[str, Any]) -> RecordedTouches:
    """The touches of a ``tomoskin.Touches``."""
    touches = tuple(map(_touch_of, content["touches"]))
    return RecordedTouches(content["host_time"], content["sequence"], touches)


def truth_of(content: Mapping[str, Any]) -> Truth:
    """The presses and bends of a ``tomoskin.Truth``."""
    bends = tuple(content.get("bends", ()))
    return Truth(content["host_time"], tuple(content["presses"]), bends)


def event_of(content: Mapping[str, Any]) -> Event:
    """The event of a ``foxglove.Log``."""
    return Event(content["host_time"], content["name"], content["message"])


def _touch_of(item: dict[str, Any]) -> Touch:
    sd_x, sd_y = (float("nan") if item[k] is None else item[k] for k in ("sd_x", "sd_y"))
    place = item["x"], item["y"], sd_x, sd_y, item["area"], item["peak"], _NO_CELLS
    cov_xy, close, merged = (item.get(k) for k in ("cov_xy", "close", "merged"))  # format 1.0: none
    reading = Detection(*place, cov_xy=cov_xy or 0.0, close=bool(close))
    return Touch(item["id"], item["kind"], item["since"], reading, tuple(merged or ()))


def _number(item: Any) -> Any:
    if isinstance(item, np.generic | np.ndarray):
        return item.tolist()
    raise NotImplementedError(f"expected plain values, got {type(item).__name__}")
