"""The boards that tomoskin knows, one record each: ``boards.toml`` says what a field means."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from typing import Literal

import msgspec

from tomoskin.board.wire import BoardLimits


class _Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A table of the file; a key that it does not know is an error."""


class Converter(_Record, frozen=True, kw_only=True):
    """How long a board's converter takes."""

    clock: float
    divided: bool
    clocks: int
    dropped: int = 0

    def conversion(self, prescaler: int) -> float:
        """The seconds that one conversion takes."""
        return self.clocks * (prescaler if self.divided else 1) / self.clock


class Chop(_Record, frozen=True, kw_only=True):
    """The alternating drive of a board, in the fields of BOARD; 0 Hz where it has none."""

    min_chop: int = 0
    max_chop: int = 0
    half: int = 0
    sample: int = 0
    conversion: int = 0
    clock: int = 0


class FirmwareFiles(_Record, frozen=True, kw_only=True):
    """How a board's firmware is built, and what comes of it; ``{}`` is the number of channels."""

    folder: str
    make: str
    program: str
    make_image: str
    image: str
    needs: tuple[str, ...]
    packages: str


class BoardFigures(_Record, frozen=True, kw_only=True):
    """A board's electronics as simulated.

    Attributes
    ----------
    noise
        Standard deviation of one conversion before it is rounded, LSB of ten bits.
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


class BoardRecord(_Record, frozen=True, kw_only=True):
    """All that host, twin, build, flash, emulator, check and docs need to know of a board."""

    text: str
    channels: tuple[int, ...]
    adc_bits: int
    max_drives: int
    max_samples: int
    tick_rate: float
    current: float
    gain: float
    reference: float
    usb_reference: bool = False
    against: Literal["neighbour", "jumper", ""] = ""
    converter: Converter
    electronics: BoardFigures
    chop: Chop = Chop()
    usb: tuple[tuple[int, int], ...] = ()
    flash: Literal["avrdude", "uf2", ""] = ""
    avrdude: str = ""
    emulator: Literal["simavr", "rp2040js", ""] = ""
    firmware: FirmwareFiles | None = None

    @property
    def ring_drop(self) -> float:
        """The V between neighbours of its check's ring: seven tenths of what it can read."""
        return round(0.7 * self.reference / self.gain, 3)

    @property
    def limits(self) -> BoardLimits:
        """What its firmware answers to GET_BOARD."""
        name = self.text.encode().ljust(24, b"\0")
        return BoardLimits(request=0, name=name, **msgspec.structs.asdict(self.chop))


def read_boards(text: str) -> dict[str, BoardRecord]:
    """The records of a file, by the names that options and commands give them.

    A board whose electronics were not simulated is taken to have those of the first.
    """
    tables = tomllib.loads(text)
    first = next(iter(tables.values()))
    for table in tables.values():
        table.setdefault("electronics", first.get("electronics"))
    return msgspec.convert(tables, dict[str, BoardRecord])


BOARDS = read_boards(
    files("tomoskin.board.source").joinpath("boards.toml").read_text(encoding="utf-8")
)
"""The records by their names."""

DEFAULT_BOARD = "mega"
"""The board where none is named: the slowest, with the fewest channels."""


def board_named(text: str) -> BoardRecord | None:
    """The record of a board that calls itself ``text``; None where it is not known."""
    return next((board for board in BOARDS.values() if board.text == text), None)
