"""A simulated processor: its process and the memory that the sheet shares with it."""

from __future__ import annotations

import mmap
import secrets
import struct
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import astuple, dataclass, field, replace
from pathlib import Path
from typing import IO, Protocol, Self

import numpy as np

from tomoskin.board.source import current_damaged
from tomoskin.board.wire import Info, crc16
from tomoskin.core import FloatArray, SourceError, StrPath

MOST_ELECTRODES = 32
_MAGIC = 0x31306E696B736F74
_HEAD = struct.Struct("<QII7d")
_SEQUENCE = struct.Struct("<I")
_SEQUENCE_AT = 8
_FAULTS_AT = _HEAD.size + 8 * MOST_ELECTRODES**2
_POTENTIALS_AT = _FAULTS_AT + 4 * 4 + 3 * MOST_ELECTRODES
_OFFSETS_AT = _POTENTIALS_AT + 8 * MOST_ELECTRODES
_LAYER = struct.Struct("<2d")
_LAYER_AT = _OFFSETS_AT + 8 * MOST_ELECTRODES
_SIZE = _LAYER_AT + _LAYER.size


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


@dataclass(frozen=True, slots=True)
class OwnVoltages:
    """What is read though it does not come from the sheet.

    ``potentials`` (n,) V that each electrode has by itself, such as a thermoelectric voltage;
    ``offsets`` (n,) V of each channel's amplifier, at its input; ``double_layer`` F of an electrode
    that polarises, or 0, and ``leak`` Ω across it.
    """

    potentials: FloatArray = field(default_factory=lambda: np.zeros(0))
    offsets: FloatArray = field(default_factory=lambda: np.zeros(0))
    double_layer: float = 0.0
    leak: float = 0.0


class SkinMemory:
    """A file, mapped by this process and by the emulator's; a seqlock, so nobody waits."""

    def __init__(
        self,
        path: StrPath,
        front: Front,
        resistance: FloatArray,
        own: OwnVoltages | None = None,
        faults: bytes = b"",
    ) -> None:
        """Make the file; ``resistance`` as in :meth:`write`. Without ``own``: none.

        ``faults`` of the board, as ``firmware/host/skin.h`` has them; zeros are none.
        """
        self.path = Path(path)
        self._n = len(resistance)
        if self._n > MOST_ELECTRODES:
            raise SourceError(
                f"expected at most {MOST_ELECTRODES} electrodes, got {self._n}", where="emulator"
            )
        with self.path.open("w+b") as file:
            file.truncate(_SIZE)
            self._map = mmap.mmap(file.fileno(), _SIZE)
        self._sequence = 0
        _HEAD.pack_into(self._map, 0, _MAGIC, 0, self._n, *astuple(front))
        self._map[_FAULTS_AT : _FAULTS_AT + len(faults)] = faults
        own = own or OwnVoltages()
        _LAYER.pack_into(self._map, _LAYER_AT, own.double_layer, own.leak)
        self._put(_OFFSETS_AT, own.offsets)
        self.write_potentials(own.potentials)
        self.write(resistance)

    def write(self, resistance: FloatArray) -> None:
        """(n, n) Ω transfer resistance from now on."""
        self._put(_HEAD.size, resistance)

    def write_potentials(self, potentials: FloatArray) -> None:
        """(n,) V that each electrode has by itself from now on."""
        self._put(_POTENTIALS_AT, potentials)

    def _put(self, at: int, numbers: FloatArray) -> None:
        data = numbers.astype("<f8").tobytes()
        self._count()
        self._map[at : at + len(data)] = data
        self._count()

    def _count(self) -> None:
        """Odd while it is written; the interpreter keeps the order, and so does the processor."""
        self._sequence = (self._sequence + 1) % 2**32
        _SEQUENCE.pack_into(self._map, _SEQUENCE_AT, self._sequence)

    def close(self) -> None:
        """Free the memory that is shared with the process."""
        self._map.close()


_EEPROM, _CHECKSUM = struct.Struct("<I8s"), struct.Struct("<H")
_NEVER_WRITTEN = b"\xff" * 8


@dataclass(frozen=True, slots=True)
class BoardIdentity:
    """What only the one who built a board knows: the setting of its current limiter, and its id.

    ``current`` A; ``unique_id``: eight bytes. They are the first bytes of its EEPROM. ``board``:
    what its firmware calls it; empty before protocol 1.2.
    """

    current: float
    unique_id: bytes
    board: str = ""

    @classmethod
    def of(cls, info: Info, board: str) -> Self:
        """The identity that the firmware reports."""
        return cls(info.current / 1e6, info.unique_id, board)

    @property
    def damaged(self) -> bool:
        """Whether what its memory holds is not what was written."""
        return current_damaged(round(self.current * 1e6))

    def change(self, current: float | None, name: str | None) -> Self:
        """With what is not None; a board that never had an id gets one."""
        unique_id = self.unique_id if name is None else name.encode().ljust(8, b"\0")
        if unique_id == _NEVER_WRITTEN:
            unique_id = secrets.token_bytes(8)
        return replace(
            self, current=self.current if current is None else current, unique_id=unique_id
        )

    def pack(self) -> bytes:
        """As the firmware reads it: µA, the id, and the checksum of both."""
        data = _EEPROM.pack(round(self.current * 1e6), self.unique_id)
        return data + _CHECKSUM.pack(crc16(data))


class BoardPrograms(Protocol):
    """The firmware of a board, and the emulator that runs it."""

    def power_on(
        self, options: Sequence[str | Path], stderr: IO[bytes]
    ) -> tuple[subprocess.Popen[bytes], str]:
        """The emulator's process, whose stderr goes to ``stderr``, and the board's serial port.

        The port is empty when it does not start.
        """


class BoardProcess:
    """An emulated board; ``port`` is its serial port."""

    def __init__(
        self, programs: BoardPrograms, memory: StrPath, current: float, *options: str | Path
    ) -> None:
        """Power on. ``memory``: of the skin; ``current`` A: what its limiter is set to.

        ``options``: further ones of the emulator.
        """
        memory = Path(memory)
        eeprom = memory.with_name("eeprom")
        eeprom.write_bytes(BoardIdentity(current, b"emulated").pack())
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - lives as long as the process
        own = ("-d", "-s", memory, "-e", eeprom)
        self._process, self.port = programs.power_on((*own, *options), self._stderr)
        if not self.port:
            self.close()
            raise SourceError(f"the emulator does not start: {self.last_words}", where="emulator")

    @property
    def alive(self) -> bool:
        """Whether the process is still running."""
        return self._process.poll() is None

    @property
    def complaints(self) -> str:
        """What the emulator has said of switches that were misused; empty when none were."""
        self._stderr.seek(0)
        return self._stderr.read().decode(errors="replace")

    def close(self) -> None:
        """Switch the board off, and keep its last words."""
        if self._stderr.closed:
            return
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()
        self.last_words = self.complaints.strip()
        self._stderr.close()
