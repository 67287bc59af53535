"""The source ``emulator``, for the entry-point group ``tomoskin.sources``."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tomoskin.board.source import SerialTransport, Transport, read_options
from tomoskin.core import FloatArray
from tomoskin.sensing.signal import FIGURES
from tomoskin.twin import ThermalVoltages, TwinSettings, TwinSkin, read_settings
from tomoskin.twin.emulator import pico, program
from tomoskin.twin.emulator.pico import build_pico_programs
from tomoskin.twin.emulator.process import (
    BoardFaults,
    BoardProcess,
    BoardPrograms,
    Front,
    OwnVoltages,
    SkinMemory,
)
from tomoskin.twin.emulator.program import build_programs
from tomoskin.twin.emulator.transport import EmulatorTransport

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin


@dataclass(frozen=True, slots=True)
class BoardKind:
    """A board: its name for people, its converter, the channels that its firmware is built for, and
    how the parts of its emulator are."""

    text: str
    adc_bits: int
    channels: tuple[int, ...]
    build: Callable[[], BoardPrograms]


BOARDS = {
    "mega": BoardKind("Arduino Mega 2560", 10, program.CHANNELS, build_programs),
    "pico": BoardKind("Raspberry Pi Pico", pico.ADC_BITS, pico.CHANNELS, build_pico_programs),
}
"""By the name that options and commands give."""

DEFAULT = "mega"
"""The board where none is named."""


def open_emulator(argument: str, skin: Skin) -> EmulatorTransport:
    """``emulator``, ``emulator:pico``, or with options: ``emulator:pico,seed=3,preset=ideal``.

    The sheet is the twin's; of the twin's electronics, current, compliance, gain and noise, the
    amplifiers' offsets, and electrodes that polarise and have thermoelectric voltages.

    Raises
    ------
    SourceError
        For an unknown option, or when firmware and emulator cannot be built here.
    """
    options = read_options(argument, ("seed", "preset", *BOARDS), "emulator")
    board = next((name for name in BOARDS if name in options), DEFAULT)
    settings = read_settings(options, skin, "emulator").with_electrodes(skin.twin.electrodes)
    own, thermal = own_of(skin, settings)
    return EmulatorTransport(
        programs_of(board),
        TwinSkin.of(skin, settings),
        front_of(skin, settings, board),
        own,
        thermal=thermal,
    )


@contextmanager
def emulate_board(skin: Skin, board: str = DEFAULT) -> Iterator[BoardProcess]:
    """A board on the skin at rest, for a host that opens its port itself; SourceError."""
    settings = TwinSettings.preset(skin.twin.preset).with_electrodes(skin.twin.electrodes)
    resistance, (own, _) = TwinSkin.of(skin, settings).resistance(), own_of(skin, settings)
    with tempfile.TemporaryDirectory(prefix="tomoskin-") as folder:
        front = front_of(skin, settings, board)
        memory = SkinMemory(Path(folder) / "skin", front, resistance, own=own)
        process = BoardProcess(programs_of(board), memory.path, skin.current)
        try:
            yield process
        finally:
            process.close()
            memory.close()


@contextmanager
def emulate_load(
    resistance: FloatArray,
    current: float,
    board: str = DEFAULT,
    faults: BoardFaults | None = None,
) -> Iterator[Transport]:
    """A board on a network of resistors, of (n, n) Ω transfer resistance; SourceError.

    ``current`` A; ``faults`` of a Mega's board: without it, none. The converter is as noisy as the
    decks say, and has the Mega's scale.
    """
    levels = float(1 << BOARDS[board].adc_bits)
    noise = FIGURES.noise * levels / 1024
    front = Front(current, FIGURES.compliance, 35.0, 0.0, 5.0, levels, noise)
    with tempfile.TemporaryDirectory(prefix="tomoskin-") as folder:
        memory = SkinMemory(Path(folder) / "skin", front, resistance, faults)
        process = BoardProcess(programs_of(board), memory.path, current)
        try:
            transport = SerialTransport(process.port)
            yield transport
            transport.close()
        finally:
            process.close()
            memory.close()


def programs_of(board: str) -> BoardPrograms:
    """Firmware and emulator of one of :data:`BOARDS`, built if need be; SourceError."""
    return BOARDS[board].build()


def own_of(skin: Skin, settings: TwinSettings) -> tuple[OwnVoltages, ThermalVoltages]:
    """What is read of electrodes and amplifiers themselves, and how their warmth wanders."""
    electronics, n = settings.electronics, skin.n_electrodes
    offsets, warmth = np.random.SeedSequence(settings.seed).spawn(2)
    thermal = ThermalVoltages(n, electronics, warmth)
    polarises = math.isfinite(electronics.double_layer)
    own = OwnVoltages(
        potentials=thermal.volts,
        offsets=electronics.offset_sd * np.random.default_rng(offsets).standard_normal(n),
        double_layer=electronics.double_layer if polarises else 0.0,
        leak=electronics.leak,
    )
    return own, thermal


def front_of(skin: Skin, settings: TwinSettings, board: str = DEFAULT) -> Front:
    """The board before a skin, as far as the emulator knows it.

    The skin file's read-out is that of the board it was made for. Another one's amplifier uses as
    much of its own converter's scale, and is as noisy in volts.
    """
    compliance = settings.electronics.compliance
    readout = skin.readout
    bits = max(BOARDS[board].adc_bits, readout.adc_bits)
    return Front(
        current=skin.current,
        compliance=1e300 if math.isinf(compliance) else compliance,
        gain=readout.gain,
        offset=readout.offset,
        reference=readout.reference_voltage,
        levels=float(1 << bits),
        noise=settings.electronics.noise * (1 << bits - readout.adc_bits),
    )
