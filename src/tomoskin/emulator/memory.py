"""The memory through which an emulated converter sees the sheet: ``firmware/host/skin.h``."""

from __future__ import annotations

import mmap
import struct
from dataclasses import astuple, dataclass
from pathlib import Path

from tomoskin.core import FloatArray, SourceError

MOST_ELECTRODES = 32
_MAGIC = 0x31306E696B736F74
_HEAD = struct.Struct("<QII7d")
_SEQUENCE = struct.Struct("<I")
_SEQUENCE_AT = 8
_SIZE = _HEAD.size + 8 * MOST_ELECTRODES**2


@dataclass(frozen=True, slots=True)
class Front:
    """What stands between sheet and code: code = (gain V + offset) levels / reference.

    ``current`` A; ``compliance`` V across the driven pair at most; ``offset`` and ``reference`` V;
    ``noise`` LSB, standard deviation of one conversion.
    """

    current: float
    compliance: float
    gain: float
    offset: float
    reference: float
    levels: float
    noise: float


class SkinMemory:
    """A file, mapped by this process and by the emulator's; a seqlock, so nobody waits."""

    def __init__(self, path: Path, front: Front, resistance: FloatArray) -> None:
        """Make the file; ``resistance`` as in :meth:`write`."""
        self.path = path
        self._n = len(resistance)
        if self._n > MOST_ELECTRODES:
            raise SourceError(
                f"expected at most {MOST_ELECTRODES} electrodes, got {self._n}", where="emulator"
            )
        with path.open("w+b") as file:
            file.truncate(_SIZE)
            self._map = mmap.mmap(file.fileno(), _SIZE)
        self._sequence = 0
        _HEAD.pack_into(self._map, 0, _MAGIC, 0, self._n, *astuple(front))
        self.write(resistance)

    def write(self, resistance: FloatArray) -> None:
        """(n, n) Ω transfer resistance from now on."""
        data = resistance.astype("<f8").tobytes()
        self._count()
        self._map[_HEAD.size : _HEAD.size + len(data)] = data
        self._count()

    def _count(self) -> None:
        """Odd while it is written; the interpreter keeps the order, and so does the processor."""
        self._sequence = (self._sequence + 1) % 2**32
        _SEQUENCE.pack_into(self._map, _SEQUENCE_AT, self._sequence)

    def close(self) -> None:
        """Give the memory back."""
        self._map.close()
