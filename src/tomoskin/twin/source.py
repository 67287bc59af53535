"""The source ``twin``, for the entry-point group ``tomoskin.sources``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from tomoskin.board.source import read_options
from tomoskin.core import Clock, SourceError, WallClock
from tomoskin.twin.board import Board
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.electronics import TwinElectronics
from tomoskin.twin.line import Line
from tomoskin.twin.presets import PRESETS, TwinSettings
from tomoskin.twin.sheet import TwinSkin
from tomoskin.twin.transport import TwinTransport

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin

_BOARDS = (8, 16, 32)
"""Channels that boards come with."""


def open_twin(argument: str, skin: Skin) -> TwinTransport:
    """``twin``, or with options, joined by commas: ``twin:seed=3,noise=2``.

    ``seed=N``: of noise, spread and temperature. ``fast``: no waiting. ``preset=NAME``: another
    material and board than the skin file's. ``noise=LSB``: of one conversion.

    Raises
    ------
    SourceError
        For an unknown option or value.
    """
    options = read_options(argument, ("seed", "fast", "preset", "noise"), "twin")
    settings = read_settings(options, skin, "twin")
    if "noise" in options:
        settings = settings.with_noise(_noise(options["noise"]))
    return make_twin(skin, settings, WallClock(), 0.0 if "fast" in options else 1.0)


def read_settings(options: Mapping[str, str], skin: Skin, where: str) -> TwinSettings:
    """The twin's settings by the options ``seed`` and ``preset``, else 0 and the skin's preset.

    Raises SourceError that names ``where`` for a value that is neither.
    """
    seed = options.get("seed", "0")
    if not (seed.isascii() and seed.isdigit()):
        raise SourceError(f'expected a seed of 0 or more, got "{seed}"', where=where)
    preset = options.get("preset", skin.twin.preset)
    if preset not in PRESETS:
        names = ", ".join(PRESETS)
        raise SourceError(f'expected a preset of {names}, got "{preset}"', where=where)
    return TwinSettings.preset(preset, int(seed))


def make_twin(skin: Skin, settings: TwinSettings, clock: Clock, pace: float = 1.0) -> TwinTransport:
    """A twin that takes its time from ``clock``; ``pace`` 0 does not wait between frames."""
    electronics = make_electronics(skin, settings)
    board = Board(
        channels=next((n for n in _BOARDS if n >= skin.n_electrodes), skin.n_electrodes),
        adc_bits=skin.readout.adc_bits,
        current=skin.current,
        tick_rate=skin.readout.tick_rate,
        unique_id=b"twin" + (settings.seed % 2**32).to_bytes(4, "big"),
    )
    device = TwinDevice(electronics, board, clock.now(), pace)
    return TwinTransport(electronics, device, clock, Line(settings.line, settings.seed))


def make_electronics(skin: Skin, settings: TwinSettings) -> TwinElectronics:
    """Sheet and electronics of a twin, without the board's firmware and the wire.

    For scripts that need the counts only: ``set_presses`` on its ``sheet``, then ``sample``.
    """
    settings = settings.with_electrodes(skin.twin.electrodes)
    sheet = TwinSkin.of(skin, settings)
    return TwinElectronics(sheet, skin.readout, skin.current, settings.electronics, settings.seed)


def _noise(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= 1e6:  # NaN fails too
        raise SourceError(f'expected a noise of 0 LSB or more, got "{text}"', where="twin")
    return value
