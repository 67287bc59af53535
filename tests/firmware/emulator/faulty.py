"""What is wrong with an emulated board, for tests of what notices it."""

from __future__ import annotations

import struct
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from tomoskin_emulator.board_process import MOST_ELECTRODES

_FAULTS = struct.Struct(f"<4I{MOST_ELECTRODES}s{MOST_ELECTRODES}s{MOST_ELECTRODES}s")


@dataclass(frozen=True, slots=True)
class BoardFaults:
    """What is wrong with an emulated board; the Pico's emulator knows ``reading`` alone.

    ``high_open``, ``low_open``: channels whose switch never connects them to the current, or to
    ground; ``high_stuck``, ``low_stuck``: always; of the stuck ones the lowest counts, on one side.
    ``source``, ``sink``, ``reading``: the channel that is connected, or read, instead of another.
    """

    high_open: Collection[int] = ()
    low_open: Collection[int] = ()
    high_stuck: Collection[int] = ()
    low_stuck: Collection[int] = ()
    source: Mapping[int, int] = field(default_factory=dict)
    sink: Mapping[int, int] = field(default_factory=dict)
    reading: Mapping[int, int] = field(default_factory=dict)

    def pack(self) -> bytes:
        """As ``firmware/host/skin.h`` has it."""
        masks = (self.high_open, self.low_open, self.high_stuck, self.low_stuck)
        maps = (self.source, self.sink, self.reading)
        return _FAULTS.pack(
            *(sum(1 << channel for channel in mask) for mask in masks),
            *(bytes(1 + one[e] if e in one else 0 for e in range(MOST_ELECTRODES)) for one in maps),
        )
