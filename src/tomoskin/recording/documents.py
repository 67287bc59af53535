"""Messages of ours as plain values, and how plain values become JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec
import numpy as np

from tomoskin.core import Touch


def touches_message(host_time: float, sequence: int, touches: Sequence[Touch]) -> dict[str, Any]:
    """A ``tomoskin.Touches``: those of the frame ``sequence``; m, m², the image's unit."""
    rows = [touch_row(touch) for touch in touches]
    return {"host_time": host_time, "sequence": sequence, "touches": rows}


def encode_json(content: Mapping[str, Any]) -> bytes:
    """JSON whose numbers come back to the bit; what is not finite becomes null."""
    return msgspec.json.encode(content, enc_hook=_number)


def plain(item: Any) -> dict[str, Any]:
    """A mapping or a record as plain values by name."""
    if isinstance(item, Mapping):
        return dict(item)
    found: dict[str, Any] = msgspec.to_builtins(item, enc_hook=_number)
    return found


def _number(item: Any) -> Any:
    if isinstance(item, np.generic | np.ndarray):
        return item.tolist()
    raise NotImplementedError(f"expected plain values, got {type(item).__name__}")


def touch_row(touch: Touch) -> dict[str, Any]:
    """One touch as plain values by name."""
    r = touch.detection
    return {
        "id": touch.id, "kind": touch.kind, "since": touch.since,
        "x": r.x, "y": r.y, "sd_x": r.sd_x, "sd_y": r.sd_y, "area": r.area, "peak": r.peak,
        "cov_xy": r.cov_xy, "close": r.close, "merged": touch.merged,
    }  # fmt: skip
