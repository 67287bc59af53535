"""What the board's circuit was found to do: ``board.toml``, which the decks of hardware/ write."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib.resources import files


@dataclass(frozen=True, slots=True)
class BoardFigures:
    """The board as simulated.

    Attributes
    ----------
    noise
        Standard deviation of one conversion before it is rounded, LSB.
    input_noise, amplifier_noise
        The same at the amplifier's input, V; that of amplifier and current alone, V.
    compliance
        Most that the current source drives its load with, V.
    output_resistance, switch_resistance
        Across the current source; of a switch, the mean of high and low side, Ω.
    low_rail, high_rail
        Least and largest output of the amplifier, V.
    time_constant, settling
        Of a channel after a switch of the drive; until it is within half an LSB, s.
    current_error
        Largest relative error into 0.5 to 20 Ω.
    peak
        Largest current into the skin at a switch over the nominal one.
    """

    noise: float
    input_noise: float
    amplifier_noise: float
    compliance: float
    output_resistance: float
    switch_resistance: float
    low_rail: float
    high_rail: float
    time_constant: float
    settling: float
    current_error: float
    peak: float


FIGURES = BoardFigures(
    **tomllib.loads(files("tomoskin.signal").joinpath("board.toml").read_text(encoding="utf-8"))[
        "board"
    ]
)
