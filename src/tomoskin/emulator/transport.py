"""The emulated board as a source."""

from __future__ import annotations

import math
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin.core import SourceError
from tomoskin.emulator.process import BoardProcess, Front, SkinMemory
from tomoskin.emulator.program import Programs, build_programs
from tomoskin.source import SerialTransport, read_options
from tomoskin.twin import Contact, Pose, TwinSettings, TwinSkin, read_settings

if TYPE_CHECKING:
    from tomoskin.skin import Skin


_STEP = 0.01
"""Between two looks at the sheet, s."""


class EmulatorTransport:
    """Bytes of a board that is simulated down to its processor."""

    def __init__(
        self,
        programs: Programs,
        sheet: TwinSkin,
        front: Front,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Power the board on; SourceError when it does not start."""
        self.name = "emulator"
        self.sheet = sheet
        self._clock = clock
        self._stood = clock()
        self._closed = False
        self._folder = Path(tempfile.mkdtemp(prefix="tomoskin-"))
        self._written = sheet.resistance()
        self._memory = SkinMemory(self._folder / "skin", front, self._written)
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

    def write(self, data: bytes) -> None:
        """Send ``data``."""
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
        self._stood = now
        resistance = self.sheet.resistance()
        if resistance is not self._written:
            self._memory.write(resistance)
            self._written = resistance


def open_emulator(argument: str, skin: Skin) -> EmulatorTransport:
    """``emulator``, or with options, joined by commas: ``emulator:seed=3,preset=ideal``.

    The sheet is the twin's; of the twin's electronics, current, compliance, gain and noise.

    Raises
    ------
    SourceError
        For an unknown option, or when firmware and emulator cannot be built here.
    """
    options = read_options(argument, ("seed", "preset"), "emulator")
    settings = read_settings(options, skin, "emulator")
    return EmulatorTransport(
        build_programs(), TwinSkin.of(skin, settings), front_of(skin, settings)
    )


@contextmanager
def emulate_board(skin: Skin) -> Iterator[BoardProcess]:
    """A board on the skin at rest, for a host that opens its port itself; SourceError."""
    settings = TwinSettings.preset(skin.twin.preset)
    resistance = TwinSkin.of(skin, settings).resistance()
    with tempfile.TemporaryDirectory(prefix="tomoskin-") as folder:
        memory = SkinMemory(Path(folder) / "skin", front_of(skin, settings), resistance)
        board = BoardProcess(build_programs(), memory.path, skin.current)
        try:
            yield board
        finally:
            board.close()
            memory.close()


def front_of(skin: Skin, settings: TwinSettings) -> Front:
    """The board of a skin, as far as the emulator knows it."""
    compliance = settings.electronics.compliance
    return Front(
        current=skin.current,
        compliance=1e300 if math.isinf(compliance) else compliance,
        gain=skin.readout.gain,
        offset=skin.readout.offset,
        reference=skin.readout.reference_voltage,
        levels=float(1 << skin.readout.adc_bits),
        noise=settings.electronics.noise,
    )
