"""The source ``twin``, for the entry-point group ``tomoskin.sources``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tomoskin.core import SourceError
from tomoskin.source import read_options
from tomoskin.twin.board import Board
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.readout import TwinElectronics
from tomoskin.twin.sheet import TwinSettings, TwinSkin
from tomoskin.twin.transport import Clock, TwinTransport, WallClock

if TYPE_CHECKING:
    from tomoskin.skin import Skin

_BOARDS = (8, 16, 32)
"""Channels that boards come with."""


def open_twin(argument: str, skin: Skin) -> TwinTransport:
    """``twin``, or with options: ``twin:seed=3`` (noise), ``twin:fast`` (no waiting).

    Raises
    ------
    SourceError
        For an unknown option.
    """
    options = read_options(argument, ("seed", "fast"), "twin")
    seed = options.get("seed", "0")
    if not seed.isdigit():
        raise SourceError(f'expected a seed of 0 or more, got "{seed}"', where="twin")
    pace = 0.0 if "fast" in options else 1.0
    return make_twin(skin, TwinSettings(seed=int(seed)), WallClock(), pace)


def make_twin(skin: Skin, settings: TwinSettings, clock: Clock, pace: float = 1.0) -> TwinTransport:
    """A twin that takes its time from ``clock``; ``pace`` 0 does not wait between frames."""
    sheet = TwinSkin.of(skin, settings)
    electronics = TwinElectronics(sheet, skin.readout, skin.current, settings.noise, settings.seed)
    board = Board(
        channels=next((n for n in _BOARDS if n >= skin.n_electrodes), skin.n_electrodes),
        adc_bits=skin.readout.adc_bits,
        current=skin.current,
        tick_rate=skin.readout.tick_rate,
    )
    return TwinTransport(sheet, TwinDevice(electronics, board, clock.now(), pace), clock)
