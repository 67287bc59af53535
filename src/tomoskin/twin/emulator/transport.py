"""Bytes of an emulated board, and the sheet before its converter."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tomoskin.board.source import SerialTransport
from tomoskin.core import SourceError
from tomoskin.twin import Contact, Pose, ThermalVoltages, TwinSkin
from tomoskin.twin.emulator.process import (
    BoardProcess,
    BoardPrograms,
    Front,
    OwnVoltages,
    SkinMemory,
)

_STEP = 0.01
"""Between two looks at the sheet, s."""


class EmulatorTransport:
    """Bytes of a board that is simulated down to its processor."""

    def __init__(
        self,
        programs: BoardPrograms,
        sheet: TwinSkin,
        front: Front,
        own: OwnVoltages | None = None,
        *,
        thermal: ThermalVoltages | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Power the board on; SourceError when it does not start.

        ``own``: without it, none; ``thermal`` takes the place of its potentials.
        """
        self.name = "emulator"
        self.sheet = sheet
        self._clock = clock
        self._stood = clock()
        self._closed = False
        self._folder = Path(tempfile.mkdtemp(prefix="tomoskin-"))
        self._written = sheet.resistance()
        self._memory = SkinMemory(self._folder / "skin", front, self._written, own=own)
        self._thermal = thermal
        if thermal:
            self._memory.write_potentials(thermal.volts)
        self._board: BoardProcess | None = None
        self._serial: SerialTransport | None = None
        try:
            self._board = BoardProcess(programs, self._memory.path, front.current)
            self._serial = SerialTransport(self._board.port)
        except SourceError:
            self.close()
            raise

    @property
    def presses(self) -> tuple[Contact, ...]:
        """What presses on the sheet now."""
        return self.sheet.presses

    def set_presses(self, presses: tuple[Contact, ...]) -> None:
        """Replace all presses; GeometryError when one is off the skin."""
        self.sheet.set_presses(presses)

    def set_pose(self, pose: Pose) -> None:
        """Bend and stretch the sheet; GeometryError for a shape that it cannot take."""
        self.sheet.set_pose(pose)

    def read(self, timeout: float) -> bytes:
        """What has come, waiting at most ``timeout`` s for the first byte."""
        self._age()
        return self._open.read(timeout)

    @property
    def waited(self) -> float:
        """How long the first byte of the last read had waited here, s."""
        return self._open.waited

    def write(self, data: bytes) -> None:
        """Send ``data`` to the board."""
        self._open.write(data)

    def close(self) -> None:
        """Power the board off."""
        if self._closed:
            return
        self._closed = True
        if self._serial:
            self._serial.close()
        if self._board:
            self._board.close()
        self._memory.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    @property
    def complaints(self) -> str:
        """What the emulated switches were misused for; empty when they were not."""
        return self._board.complaints if self._board and not self._closed else ""

    @property
    def _open(self) -> SerialTransport:
        if self._closed or self._serial is None:
            raise SourceError("the emulator has been switched off", where=self.name)
        return self._serial

    def _age(self) -> None:
        """Let the sheet go on to now, and show the converter what it has become."""
        now = self._clock()
        if self._closed or now - self._stood < _STEP:
            return
        self.sheet.advance(now - self._stood)
        if self._thermal:
            self._thermal.wander(now - self._stood)
            self._memory.write_potentials(self._thermal.volts)
        self._stood = now
        resistance = self.sheet.resistance()
        if resistance is not self._written:
            self._memory.write(resistance)
            self._written = resistance
