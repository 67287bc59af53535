"""Whether a board does what it was asked: its scan and its rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Protocol, runtime_checkable

import numpy as np

from tomoskin.board import wire
from tomoskin.board.source.boards import BOARDS, DEFAULT_BOARD, BoardRecord
from tomoskin.board.source.clock import TICK_RATES
from tomoskin.board.source.settings import ScanSettings
from tomoskin.core import SourceError, WireError
from tomoskin.model.pattern import Scan

BOARDS_SINCE = 2
"""The minor version in which boards say their name, and drive alternately."""

DRIVES_SINCE = 3
"""The minor version in which boards send drives one by one, if they are asked to."""

_MOST_SINGLY = 255
"""The most drives of a scan whose drives are sent one by one: their numbers have eight bits."""

RATES = (1_000_000, 500_000, 250_000)
"""Rates that the ATmega's clock divides into exactly, fastest first, Bd."""

_WINDOW = 50
"""Messages that are looked at together."""

_DAMAGED = 5
"""So many of them damaged, and the line is too fast: by chance in one window of 10⁵ at 1 %."""


@runtime_checkable
class Rated(Protocol):
    """A transport whose rate can be changed while it is open."""

    @property
    def rate(self) -> int:
        """Bits per second on the line."""

    def use_rate(self, rate: int) -> None:
        """Send and read at ``rate`` Bd from now on; SourceError when the device has gone away."""


class RateFollower:
    """Follows the board to another rate; asks for a slower one where too much arrives damaged."""

    def __init__(self, transport: Rated) -> None:
        self._transport, self._first = transport, transport.rate
        self._messages = self._corrupt = 0

    def follow(self, rate: int | None, *, silent: bool) -> None:
        """Use the ``rate`` that the board has changed to, or its first when it is ``silent``."""
        if silent and self._transport.rate != self._first:
            rate = self._first  # what a board that was reset speaks
        if rate is not None:
            self._transport.use_rate(rate)

    def slower(self, counters: wire.Counters, *, running: bool) -> int | None:
        """The rate to set the board up at, where this one damages too much; else None."""
        corrupt = counters.corrupt - self._corrupt
        damaged = corrupt >= _DAMAGED
        if running and not damaged and counters.messages - self._messages + corrupt < _WINDOW:
            return None
        self._messages, self._corrupt = counters.messages, counters.corrupt
        if not (running and damaged):
            return None
        return next((slower for slower in RATES if slower < self._transport.rate), None)


_UPDATE_BOARD = "flash the firmware of this tomoskin: tomoskin firmware flash"
_UPDATE_HOST = "update tomoskin on this computer, or flash an older firmware"


def check_version(board: wire.Hello | wire.Info, where: str) -> None:
    """Raise WireError unless the board was made from this host's schema or one that it grew from.

    The message says which side is older.
    """
    theirs, ours = (board.major, board.minor), (wire.SCHEMA.major, wire.SCHEMA.minor)
    hashes = {**wire.OLDER, ours: wire.SCHEMA.hash}
    if hashes.get(theirs) == board.schema_hash:
        return
    spoken = (
        f"expected protocol {ours[0]}.{ours[1]}, but the board speaks {theirs[0]}.{theirs[1]}: "
    )
    if theirs in hashes:
        raise WireError(
            f"board and host both speak protocol {theirs[0]}.{theirs[1]}, but from different "
            f"schemas (board {board.schema_hash:08x}, host {hashes[theirs]:08x})",
            where=where,
            hint=f"one of them is a development build: {_UPDATE_BOARD}",
        )
    if theirs < ours:
        raise WireError(spoken + "the board's firmware is older", where=where, hint=_UPDATE_BOARD)
    raise WireError(spoken + "this tomoskin is older", where=where, hint=_UPDATE_HOST)


def current_damaged(current: int) -> bool:
    """Whether a board says instead of its current (µA) that what it has stored is damaged."""
    return current == 0xFFFFFFFF


def fit_board(info: wire.Info, scan: Scan, asked: ScanSettings, where: str) -> ScanSettings:
    """What to set on this board for what is ``asked``; SourceError says what it lacks."""
    if not TICK_RATES[0] <= info.tick_rate <= TICK_RATES[1]:
        raise SourceError(
            f"the board states a clock of {info.tick_rate:,} Hz; expected "
            f"{TICK_RATES[0]:g} Hz to {TICK_RATES[1] / 1e6:g} MHz",
            where=where,
            hint="correct tick_rate in the firmware's INFO, or no time of a touch is right",
        )
    _check_size(info, scan, asked, where)
    settings = asked.on_board(info.adc_bits)
    if settings is None:
        raise SourceError(
            f"the skin file sums {asked.oversampling} conversions of {asked.adc_bits} bits, but "
            f"the board's converter has {info.adc_bits} bits",
            where=where,
            hint="correct [readout] adc_bits in the skin file, or every voltage is wrong"
            if info.adc_bits < asked.adc_bits
            else (
                f"set [readout] oversampling to a multiple of {1 << info.adc_bits - asked.adc_bits}"
            ),
        )
    _check_enough(
        settings.oversampling, info.max_oversampling, "conversions summed", "sum fewer", where
    )
    if settings.chop_frequency and info.minor < BOARDS_SINCE:
        raise SourceError(
            f"the skin is driven alternately, which boards do from protocol 1.{BOARDS_SINCE} on; "
            f"this one speaks {info.major}.{info.minor}",
            where=where,
            hint=f'{_UPDATE_BOARD}, or set [drive] mode = "direct"',
        )
    if current_damaged(info.current):
        raise SourceError(
            "the current that the board's memory holds is damaged: its checksum is wrong",
            where=where,
            hint='tomoskin firmware configure PORT --current "…" writes it again',
        )
    if info.current > round(settings.current_limit * 1e6):
        raise SourceError(
            f"the board's current limiter is set to {info.current / 1e3:g} mA, but this skin "
            f"allows at most {settings.current_limit * 1e3:g} mA",
            where=where,
            hint="lower the limiter before you connect the skin",
        )
    singly = settings.singly and info.minor >= DRIVES_SINCE and len(scan.drives) <= _MOST_SINGLY
    return replace(settings, singly=singly)


LOSSES_SINCE = 4
"""The minor version in which boards say what they have lost."""


def unreadable_drives(scan: Scan, *, alternating: bool) -> list[int]:
    """Drives whose source is the electrode before their sink, which some boards read against.

    Of an alternating drive both directions count. Before the first electrode comes the last one.
    """
    source, sink = scan.drives.T
    n = 1 + int(max(scan.drives.max(), scan.sample_electrode.max()))
    driven = source == (sink - 1) % n
    if alternating:
        driven |= sink == (source - 1) % n
    return [int(number) for number in np.flatnonzero(driven)]


def check_reference(record: BoardRecord | None, scan: Scan, asked: ScanSettings, where: str) -> str:
    """Whether the board can read all drives; a sentence where that depends on its jumper.

    SourceError says that it cannot, and which patterns it can.
    """
    known = record is not None and record.against
    if not known or (known == "jumper" and not asked.against_neighbour):
        return ""
    drives = unreadable_drives(scan, alternating=asked.chop_frequency > 0)
    if not drives:
        return ""
    source, sink = scan.drives[drives[0]] + 1
    how = " alternately" if asked.chop_frequency else ""
    text = (
        f"of {len(scan.drives)} drives, {len(drives)} cannot be read{how}: the amplifier reads "
        f"against the electrode before the sink, which is driven (E{source} to E{sink} the first)"
    )
    patterns = 'set [drive] pattern = "skip:1", or one that skips more'
    if known == "neighbour":
        raise SourceError(text, where=where, hint=patterns)
    return f"with jumper J41 at 1-2, {text}: {patterns}, or put J41 and J42 at 2-3"


def _check_size(info: wire.Info, scan: Scan, asked: ScanSettings, where: str) -> None:
    channels = 1 + int(max(scan.drives.max(), scan.sample_electrode.max()))
    fewer = "use a skin with fewer electrodes"
    largest = max(BOARDS.values(), key=lambda board: board.channels[-1])
    if BOARDS[DEFAULT_BOARD].channels[-1] < channels <= largest.channels[-1]:
        fewer += f", or a {largest.text}, which has up to {largest.channels[-1]}"
    values, of_frame = scan.n_samples, "samples in a frame"
    if asked.chop_frequency:
        values, of_frame = 2 * scan.n_samples, "values, two for each sample, in a frame"
    for needed, offered, what, hint in (
        (channels, info.channels, "electrodes", fewer),
        (len(scan.drives), info.max_drives, "drives", "use a shorter pattern"),
        (values, info.max_samples, of_frame, "use a shorter pattern"),
    ):
        _check_enough(needed, offered, what, hint, where)


def _check_enough(needed: int, offered: int, what: str, hint: str, where: str) -> None:
    if needed > offered:
        raise SourceError(
            f"the skin needs {needed} {what}, but the board has at most {offered}",
            where=where,
            hint=hint,
        )


def check_held(
    held: wire.HeldScan | wire.HeldPattern | wire.HeldMode, sent: Sequence[wire.Command], where: str
) -> None:
    """Raise SourceError unless the board holds what ``sent`` has set; it names what differs.

    ``sent`` are the commands behind this answer: SET_SCAN and SET_FORMAT, one SET_PATTERN, or
    SET_MODE.
    """
    names = [field.name for field in fields(held) if field.name != "request"]
    for name in names:
        expected = next(getattr(command, name) for command in sent if hasattr(command, name))
        held_value = getattr(held, name)
        if expected != held_value:
            raise SourceError(
                f"the board did not store what was sent: it has {name} {held_value}, "
                f"expected {expected}",
                where=where,
                hint="no current flows; start again, and flash the firmware if this happens again",
            )
