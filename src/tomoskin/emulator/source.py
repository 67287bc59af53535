"""The source ``emulator``, for the entry-point group ``tomoskin.sources``."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin.emulator.memory import Front, SkinMemory
from tomoskin.emulator.process import BoardProcess
from tomoskin.emulator.program import build_programs
from tomoskin.emulator.transport import EmulatorTransport
from tomoskin.source import read_options
from tomoskin.twin import TwinSettings, TwinSkin, read_settings

if TYPE_CHECKING:
    from tomoskin.skin import Skin


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
