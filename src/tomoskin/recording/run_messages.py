"""What a run says, message by message: to its recording, to sinks and to whoever else listens."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tomoskin.core import Event
from tomoskin.pipeline import FrameResult
from tomoskin.recording.documents import Truth
from tomoskin.recording.layout import MarkedFrame
from tomoskin.touch import TouchEvent
from tomoskin.wire import Info


@dataclass(frozen=True, slots=True)
class RawRead:
    """Bytes as one read of the source returned them."""

    host_time: float
    data: bytes


@dataclass(frozen=True, slots=True)
class BoardInfo:
    """What the board says that it is."""

    host_time: float
    info: Info


@dataclass(frozen=True, slots=True)
class RunSettings:
    """How the run is set: plain values by name."""

    host_time: float
    values: Mapping[str, Any]


RunMessage = RawRead | MarkedFrame | FrameResult | Event | Truth | BoardInfo | RunSettings
"""All that a run says, in the order of what happens: the bytes of a read, each frame of it with
what becomes of it, then its result. A person's remark is an event of the kind "note"."""


def event_of(happened: TouchEvent) -> Event:
    """What happened to a touch as an event: "touch-onset", "touch-move", "touch-release", …"""
    return Event(happened.host_time, f"touch-{happened.kind}", happened.text)
