"""Names of 0.1 whose rooms were divided: the old ones still work, with a warning."""

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


def moved(room: str, name: str) -> Any:
    """What ``tomoskin.room.name`` is now. Raises AttributeError where there is no such name."""
    for new in ROOMS[room]:
        found = import_module(f"tomoskin.{new}")
        if name in found.__all__:
            old = f"tomoskin.{room}.{name}"
            warnings.warn(f"{old} is now tomoskin.{new}.{name}", DeprecationWarning, stacklevel=3)
            return getattr(found, name)
    raise AttributeError(f"module 'tomoskin.{room}' has no attribute {name!r}")
