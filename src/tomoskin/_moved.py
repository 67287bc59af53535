"""Names of 0.1 that have moved or were renamed: the old ones still work, with a warning."""

from __future__ import annotations

import warnings
from functools import reduce
from importlib import import_module
from typing import Any

ROOMS = {
    "live": ("pipeline", "run", "server", "recording", "formats", "calibration"),
    "session": ("recording", "formats", "calibration", "signal", "core"),
    "touch": ("touch", "calibration"),
}
"""Where the names of a former room are looked for."""

RENAMED = {
    "calibration": {
        "StateClassifier": "Classifier",
        "StateReading": "ClassReading",
        "Teller": "FrameClassifier",
        "Wiring": "ChannelMapping",
        "WiringAnswer": "MappingAnswer",
        "read_bends": "BENDS.read",
        "read_calibration": "TOUCH.read",
        "read_states": "CLASSES.read",
        "solve_wiring": "solve_channel_mapping",
        "unpack_bends": "BENDS.decode",
        "unpack_calibration": "TOUCH.decode",
        "unpack_states": "CLASSES.decode",
    },
    "core": {"Reading": "Detection"},
    "inverse": {
        "MOST_LEFT_OUT": "MOST_EXCLUDED",
        "Pictures": "ImageSeries",
        "SourceMetrics": "ThesisMetrics",
        "pictures": "image_series",
    },
    "pipeline": {
        "Changes": "RecordedFrames",
        "Result": "FrameResult",
        "changes_of": "recorded_frames",
    },
    "signal": {"Blind": "NuisanceSubspace", "lost_directions": "nuisance_directions"},
    "source": {"Conversation": "ProtocolSession", "FrameGate": "SequenceFilter"},
    "touch": {
        "NoiseFloor": "ImageNoise",
        "Promise": "ResolutionBounds",
        "WHOLE": "EXHAUSTIVE",
        "promise": "resolution_bounds",
    },
}
"""What the names of a room are called now; after a point, an attribute of it."""


def moved(room: str, name: str) -> Any:
    """What ``tomoskin.room.name`` is now. Raises AttributeError where there is no such name."""
    for new in ROOMS.get(room, (room,)):
        now = RENAMED.get(new, {}).get(name, name)
        first, *rest = now.split(".")
        found = import_module(f"tomoskin.{new}")
        if first in found.__all__:
            old = f"tomoskin.{room}.{name}"
            warnings.warn(f"{old} is now tomoskin.{new}.{now}", DeprecationWarning, stacklevel=3)
            return reduce(getattr, rest, getattr(found, first))
    raise AttributeError(f"module 'tomoskin.{room}' has no attribute {name!r}")
