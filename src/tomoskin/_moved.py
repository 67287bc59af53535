"""Names of 0.1 that have moved or changed: the old ones still work, with a warning."""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import Any

ROOMS = {
    "live": ("pipeline", "run", "server", "recording", "formats"),
    "session": ("recording", "formats", "calibration", "signal", "core"),
    "touch": ("calibration",),
}
"""Where the names of a former room are looked for."""

RENAMED = {
    "core": {"Reading": "Detection"},
    "inverse": {
        "MOST_LEFT_OUT": "MOST_EXCLUDED",
        "Pictures": "ImageSeries",
        "SourceMetrics": "ThesisMetrics",
        "pictures": "image_series",
    },
    "signal": {"Blind": "NuisanceSubspace", "lost_directions": "nuisance_directions"},
    "touch": {
        "NoiseFloor": "ImageNoise",
        "Promise": "ResolutionBounds",
        "WHOLE": "EXHAUSTIVE",
        "promise": "resolution_bounds",
    },
}
"""Names of 0.1 that the field calls otherwise, by room: the old ones still work, with a warning."""


def moved(room: str, name: str) -> Any:
    """What ``tomoskin.room.name`` is now. Raises AttributeError where there is no such name."""
    if name in RENAMED.get(room, {}):
        now = RENAMED[room][name]
        old = f"tomoskin.{room}.{name}"
        warnings.warn(f"{old} is now tomoskin.{room}.{now}", DeprecationWarning, stacklevel=3)
        return getattr(import_module(f"tomoskin.{room}"), now)
    for new in ROOMS.get(room, ()):
        found = import_module(f"tomoskin.{new}")
        if name in found.__all__:
            old = f"tomoskin.{room}.{name}"
            warnings.warn(f"{old} is now tomoskin.{new}.{name}", DeprecationWarning, stacklevel=3)
            return getattr(found, name)
    raise AttributeError(f"module 'tomoskin.{room}' has no attribute {name!r}")
