"""The source ``emulator``: a board that is simulated down to its processor, and the sheet at it."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from pathlib import Path

import numpy as np

from tomoskin import twin
from tomoskin.board.source import BOARDS, DEFAULT_BOARD, SerialTransport, Transport, read_options
from tomoskin.core import FloatArray, SourceError, no_such
from tomoskin.model.skin import Skin
from tomoskin_emulator.board_process import (
    BoardProcess,
    BoardPrograms,
    Front,
    OwnVoltages,
    SkinMemory,
)
from tomoskin_emulator.program import programs_of

_STEP = 0.01
"""Between two looks at the sheet, s."""


class EmulatorTransport(twin.SheetTransport):
    """Bytes of a board that is simulated down to its processor."""

    def __init__(
        self,
        programs: BoardPrograms,
        sheet: twin.TwinSkin,
        front: Front,
        own: OwnVoltages | None = None,
        *,
        thermal: twin.ThermalVoltages | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Power the board on; SourceError when it does not start.

        ``own``: without it, none; ``thermal`` takes the place of its potentials.
        """
        super().__init__(sheet)
        self.name = "emulator"
        self._clock = clock
        self._stood = clock()
        self._closed = False
        self._written = sheet.resistance()
        self._thermal = thermal
        with ExitStack() as stack:
            running = powered(programs, front, self._written, own=own)
            self._board, self._memory = stack.enter_context(running)
            if thermal:
                self._memory.write_potentials(thermal.volts)
            self._serial = stack.enter_context(closing(SerialTransport(self._board.port)))
            self._stack = stack.pop_all()

    def read(self, timeout: float) -> bytes:
        """What has come, waiting at most ``timeout`` s for the first byte."""
        self._age()
        return self._open.read(timeout)

    @property
    def waited(self) -> float:
        """How long the first byte of the last read had waited here, s."""
        return self._open.waited

    def write(self, data: bytes) -> None:
        """Send ``data`` to the simulated board."""
        self._open.write(data)

    def close(self) -> None:
        """Power the board off, if it is still on."""
        if not self._closed:
            self._closed = True
            self._stack.close()

    @property
    def complaints(self) -> str:
        """What the emulated switches were misused for; empty when they were not."""
        return "" if self._closed else self._board.complaints

    @property
    def _open(self) -> SerialTransport:
        if self._closed:
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


def open_emulator(argument: str, skin: Skin) -> EmulatorTransport:
    """``emulator``, ``emulator:board=pico``, or with options: ``emulator:pico,seed=3``.

    The sheet is the twin's; of the twin's electronics, current, compliance, gain and noise, the
    amplifiers' offsets, and electrodes that polarise and have thermoelectric voltages.

    Raises
    ------
    SourceError
        For an unknown option, or when firmware and emulator cannot be built here.
    """
    options = read_options(argument, ("seed", "preset", "board", *BOARDS), "emulator")
    board = twin.read_board(options, "emulator") or DEFAULT_BOARD
    settings = twin.read_settings(options, skin, "emulator").with_electrodes(skin.twin.electrodes)
    own, thermal = own_of(skin, settings)
    return EmulatorTransport(
        programs_of(board),
        twin.TwinSkin.of(skin, settings),
        front_of(skin, settings, board),
        own,
        thermal=thermal,
    )


@contextmanager
def powered(
    programs: BoardPrograms,
    front: Front,
    resistance: FloatArray,
    *,
    own: OwnVoltages | None = None,
    faults: bytes = b"",
) -> Iterator[tuple[BoardProcess, SkinMemory]]:
    """A board on a sheet of (n, n) Ω transfer ``resistance``, and the memory that holds that."""
    with (
        tempfile.TemporaryDirectory(prefix="tomoskin-") as folder,
        closing(SkinMemory(Path(folder) / "skin", front, resistance, own, faults)) as memory,
        closing(BoardProcess(programs, memory.path, front.current)) as process,
    ):
        yield process, memory


@contextmanager
def emulate_board(skin: Skin, board: str = DEFAULT_BOARD) -> Iterator[BoardProcess]:
    """A board on the skin at rest, for a host that opens its port itself; SourceError."""
    settings = twin.TwinSettings.preset(skin.twin.preset).with_electrodes(skin.twin.electrodes)
    resistance, (own, _) = twin.TwinSkin.of(skin, settings).resistance(), own_of(skin, settings)
    front = front_of(skin, settings, board)
    with powered(programs_of(board), front, resistance, own=own) as (process, _):
        yield process


@contextmanager
def emulate_load(
    resistance: FloatArray,
    current: float,
    board: str = DEFAULT_BOARD,
    faults: bytes = b"",
) -> Iterator[Transport]:
    """A board on a network of resistors, of (n, n) Ω transfer resistance; SourceError.

    ``current`` A; ``faults`` of a Mega's board, as of :class:`SkinMemory`. The converter is as
    noisy as the decks say, and has the scale of the board's record.
    """
    record = BOARDS[board]
    levels, figures = float(1 << record.adc_bits), record.electronics
    noise = figures.noise * levels / 1024
    front = Front(current, figures.compliance, record.gain, 0.0, record.reference, levels, noise)
    with (
        powered(programs_of(board), front, resistance, faults=faults) as (process, _),
        closing(SerialTransport(process.port)) as transport,
    ):
        yield transport


def open_load(
    argument: str, resistance: FloatArray, current: float
) -> AbstractContextManager[Transport]:
    """``emulator`` or ``emulator:BOARD`` on a network of resistors; see :func:`emulate_load`.

    Raises SourceError for a board that is not known.
    """
    board = argument or DEFAULT_BOARD
    if board not in BOARDS:
        raise SourceError(no_such(board, BOARDS, "a board"), where=f"emulator:{argument}")
    return emulate_load(resistance, current, board)


def own_of(skin: Skin, settings: twin.TwinSettings) -> tuple[OwnVoltages, twin.ThermalVoltages]:
    """What is read of electrodes and amplifiers themselves, and how their warmth wanders."""
    electronics, n = settings.electronics, skin.n_electrodes
    offsets, warmth = np.random.SeedSequence(settings.seed).spawn(2)
    thermal = twin.ThermalVoltages(n, electronics, warmth)
    polarises = math.isfinite(electronics.double_layer)
    own = OwnVoltages(
        potentials=thermal.volts,
        offsets=electronics.offset_sd * np.random.default_rng(offsets).standard_normal(n),
        double_layer=electronics.double_layer if polarises else 0.0,
        leak=electronics.leak,
    )
    return own, thermal


def front_of(skin: Skin, settings: twin.TwinSettings, board: str = DEFAULT_BOARD) -> Front:
    """The board before a skin, as far as the emulator knows it.

    The skin file's read-out is that of the board it was made for. Another one's amplifier uses as
    much of its own converter's scale, and is as noisy in volts.
    """
    compliance = settings.electronics.compliance
    bits = BOARDS[board].adc_bits
    readout, noise = twin.on_converter(skin.readout, settings.electronics.noise, bits)
    return Front(
        current=skin.current,
        compliance=1e300 if math.isinf(compliance) else compliance,
        gain=readout.gain,
        offset=readout.offset,
        reference=readout.reference_voltage,
        levels=float(1 << readout.adc_bits),
        noise=noise,
    )
