"""Names of 0.1 that are elsewhere or others now: the old ones still work, with a warning."""

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

NAMES = {"source": {"Conversation": "ProtocolSession", "FrameGate": "SequenceFilter"}}
"""What names of a room are now."""


def moved(room: str, name: str) -> Any:
    """What ``tomoskin.room.name`` is now. Raises AttributeError where there is no such name."""
    new_name = NAMES.get(room, {}).get(name, name)
    for new in ROOMS.get(room, (room,)):
        found = import_module(f"tomoskin.{new}")
        if new_name in found.__all__:
            old, now = f"tomoskin.{room}.{name}", f"tomoskin.{new}.{new_name}"
            warnings.warn(f"{old} is now {now}", DeprecationWarning, stacklevel=3)
            return getattr(found, new_name)
    raise AttributeError(f"module 'tomoskin.{room}' has no attribute {name!r}")
