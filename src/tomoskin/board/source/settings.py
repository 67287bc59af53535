"""What a link asks of a board, as the commands that set it there, and how long it waits for it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

from tomoskin.board import wire
from tomoskin.board.source.boards import BOARDS, DEFAULT_BOARD, board_named
from tomoskin.core import SourceError
from tomoskin.model.pattern import Scan

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin

PRESCALERS = (16, 32, 64, 128)
"""Clock dividers of the ATmega2560's converter that leave it accurate enough."""

_PACKED_BITS = 10


@dataclass(frozen=True)
class ScanSettings:
    """Timing and limits of a scan.

    Attributes
    ----------
    oversampling
        Conversions summed per sample.
    settling
        From connecting a drive to its first conversion, s.
    current_limit
        What the skin may carry, A; a board set higher refuses.
    adc_bits
        Converter resolution that the voltages are worked out with.
    dead_time
        All channels high-impedance between two drives, s. After a cut electrode the board's source
        needs 5 µs to come back from its end stop.
    prescaler
        Converter clock divider; 64 is 250 kHz at 16 MHz.
    chop_frequency
        Of an alternating drive, Hz; 0: the drive is direct.
    against_neighbour
        Whether the skin file has an offset, so the amplifiers read against the electrode before the
        sink, where a jumper of the board chooses.
    singly
        Whether each drive is sent when it has been read, where the board can; else whole scans.
    """

    oversampling: int
    settling: float
    current_limit: float
    adc_bits: int
    dead_time: float = 5e-6
    prescaler: int = 64
    chop_frequency: int = 0
    against_neighbour: bool = False
    singly: bool = False

    def __post_init__(self) -> None:
        """Check what every board would refuse."""
        if not 1 <= self.oversampling <= 64:
            raise SourceError(f"expected oversampling from 1 to 64, got {self.oversampling}")
        if self.oversampling * (2**self.adc_bits - 1) > 0xFFFF:
            raise SourceError(
                f"{self.oversampling} conversions of {self.adc_bits} bits do not fit a sample of "
                "16 bits",
                hint="lower the oversampling",
            )
        if not 0 <= self.settling <= 0.1:
            raise SourceError(f"expected a settling time from 0 to 0.1 s, got {self.settling} s")
        if self.prescaler not in PRESCALERS:
            raise SourceError(f"expected a prescaler of {PRESCALERS}, got {self.prescaler}")

    @property
    def format(self) -> wire.Format:
        """How samples are sent: one conversion of ten bits is shorter on the line when packed."""
        packs = self.oversampling == 1 and self.adc_bits == _PACKED_BITS
        if self.singly:
            return wire.Format.DRIVES_PACKED if packs else wire.Format.DRIVES
        return wire.Format.PACKED if packs else wire.Format.SIXTEEN

    def on_board(self, adc_bits: int) -> Self | None:
        """The settings that give samples of the same scale on a converter of ``adc_bits``.

        A finer one sums fewer conversions: 4 of 12 bits reach as far as 16 of 10 bits. None where
        it cannot be.
        """
        fewer = 1 << max(adc_bits - self.adc_bits, 0)
        if adc_bits < self.adc_bits or self.oversampling % fewer:
            return None
        return replace(self, oversampling=self.oversampling // fewer, adc_bits=adc_bits)

    @property
    def conversion(self) -> float:
        """Seconds of one conversion on the slowest board."""
        return BOARDS[DEFAULT_BOARD].converter.conversion(self.prescaler)

    @classmethod
    def of(cls, skin: Skin) -> Self:
        """The settings that a skin file asks for."""
        return cls(
            oversampling=skin.readout.oversampling,
            settling=skin.readout.settling,
            current_limit=skin.current,
            adc_bits=skin.readout.adc_bits,
            chop_frequency=round(skin.chop_frequency),
            against_neighbour=skin.readout.offset > 0,
        )


@dataclass(frozen=True)
class Timing:
    """Waiting times of a link, s.

    Attributes
    ----------
    hello
        How long to wait for HELLO before asking unbidden: opening a port resets a board, whose
        bootloader must not be spoken to.
    answer, tries
        How long to wait for an answer, and how often to ask.
    ping
        Between two heartbeats; a board stops after 2 s without.
    silence
        Without a frame for that long, or for four scans if that is longer, the board is silent.
    goodbye
        How long to wait for the answer to STOP on closing.
    """

    hello: float = 3.0
    answer: float = 0.3
    tries: int = 5
    ping: float = 0.5
    silence: float = 1.0
    goodbye: float = 0.3


def scan_time(
    n_drives: int,
    n_samples: int,
    settings: ScanSettings,
    board: wire.BoardLimits | None = None,
    periods: int = 0,
) -> float:
    """Seconds of one scan on ``board``; without one, on the slowest that there is.

    An alternating drive has so many ``periods``, or else as many as a board may choose.
    """
    if settings.chop_frequency:
        return n_drives * (periods or settings.oversampling // 2) / settings.chop_frequency
    drives = n_drives * (settings.settling + settings.dead_time)
    known = board_named(board.text) if board else BOARDS[DEFAULT_BOARD]
    if board is not None and known is None:  # what it says of itself
        conversion = board.conversion + board.clock * settings.prescaler
        return drives + n_samples * (board.sample + settings.oversampling * conversion) * 1e-9
    assert known is not None
    conversions = n_samples * (settings.oversampling + known.converter.dropped)
    return drives + conversions * known.converter.conversion(settings.prescaler)


def half_time(
    board: wire.BoardLimits, settings: ScanSettings, periods: int, channels: int, tick_rate: float
) -> int:
    """ns that half a period takes at least; the firmware works it out in the same way.

    ``channels`` that are read in each half; ``tick_rate`` of the board, Hz.
    """
    us_per_tick = round(1e6 / tick_rate)
    ticks = -(-round(settings.settling * 1e6) // us_per_tick) + 1
    conversion = board.conversion + board.clock * settings.prescaler
    sample = board.sample + settings.oversampling // (2 * periods) * conversion
    fixed = board.half + 1000 * round(settings.dead_time * 1e6) + 1000 * us_per_tick * ticks
    return fixed + channels * sample


def chop_limit(
    board: wire.BoardLimits, settings: ScanSettings, periods: int, channels: int, tick_rate: float
) -> int:
    """Hz: the highest frequency that the board can do with so many periods a drive."""
    half = half_time(board, settings, periods, channels, tick_rate)
    return min(500_000_000 // max(half, 1), board.max_chop)


def choose_periods(
    board: wire.BoardLimits, settings: ScanSettings, channels: int, tick_rate: float, where: str
) -> int:
    """The fewest periods a drive with which the board can do ``settings``; 0 for a direct drive.

    Raises
    ------
    SourceError
        When the frequency is beyond the board's bounds, with the limit, or the conversions cannot
        be shared between the two directions.
    """
    wanted, each = settings.chop_frequency, settings.oversampling // 2
    if not wanted:
        return 0
    if settings.oversampling % 2:
        raise SourceError(
            f"an alternating drive reads as often in either direction: {settings.oversampling} "
            "conversions a sample cannot be halved",
            where=where,
            hint="set [readout] oversampling to an even number, for a converter of 12 bits one "
            "that 8 divides",
        )
    if wanted < board.min_chop:
        raise SourceError(
            f"the skin is driven alternately at {wanted} Hz, the {board.text} does at least "
            f"{board.min_chop} Hz",
            where=where,
            hint="raise [drive] chop_frequency",
        )
    possible = [periods for periods in range(1, each + 1) if each % periods == 0]
    limits = {p: chop_limit(board, settings, p, channels, tick_rate) for p in possible}
    if wanted > max(limits.values()):
        raise SourceError(
            f"the skin is driven alternately at {wanted} Hz; with {channels} electrodes to read "
            f"and {settings.settling * 1e6:.0f} µs to settle in each half period the {board.text} "
            f"does at most {max(limits.values())} Hz",
            where=where,
            hint="lower [drive] chop_frequency, or [readout] settling if the skin settles faster",
        )
    return next(periods for periods in possible if wanted <= limits[periods])


_FORMATS_SINCE = 1
"""The minor version that brought formats and reading back."""


@dataclass(frozen=True)
class Configuration:
    """Identity and commands; request ids are filled in when a command is sent.

    The identity is a checksum of ``scan`` and ``patterns``, never 0: the same scan has the same
    identity on every host, and frames of another scan are recognised. ``scan_time`` is that of the
    board, s, or before one is known that of the slowest.
    """

    identity: int
    scan: wire.SetScan
    patterns: tuple[wire.SetPattern, ...]
    format: wire.SetFormat
    n_samples: int
    scan_time: float
    mode: wire.SetMode | None = None
    """None: the drive is direct, as SET_SCAN leaves it."""

    def commands(self, minor: int) -> tuple[wire.Command, ...]:
        """What sets it on a board of protocol 1.``minor``, reads it back, and starts it."""
        start = wire.Start(0, self.identity)
        if minor < _FORMATS_SINCE:
            return (self.scan, *self.patterns, start)
        read_back = (wire.GetPattern(0, pattern.first) for pattern in self.patterns)
        mode, held = ((self.mode,), (wire.GetMode(0),)) if self.mode else ((), ())
        settings = (self.scan, *self.patterns, self.format, *mode)
        return (*settings, wire.GetScan(0), *read_back, *held, start)

    @property
    def singly(self) -> bool:
        """Whether it asks for each drive in a message of its own."""
        return self.format.format in (wire.Format.DRIVES, wire.Format.DRIVES_PACKED)

    @cached_property
    def channels(self) -> tuple[int, ...]:
        """How many channels each drive reads."""
        drives = (drive for pattern in self.patterns for drive in pattern.drives)
        return tuple(drive.mask.bit_count() for drive in drives)

    def behind(self, question: wire.Command) -> tuple[wire.Command, ...]:
        """The commands that set what a GET_SCAN, GET_PATTERN or GET_MODE asks for."""
        if isinstance(question, wire.GetMode):
            return (self.mode,) if self.mode else ()
        if isinstance(question, wire.GetPattern):
            return tuple(pattern for pattern in self.patterns if pattern.first == question.first)
        return (self.scan, self.format)

    def on_board(
        self, fitted: ScanSettings, board: wire.BoardLimits | None = None, periods: int = 0
    ) -> Self:
        """The same scan as a ``board`` with another converter does it: under the same identity.

        ``periods`` of each alternating drive.
        """
        return replace(
            self,
            scan=replace(self.scan, oversampling=fitted.oversampling),
            format=replace(self.format, format=fitted.format),
            mode=self.mode and replace(self.mode, periods=periods),
            scan_time=scan_time(self.scan.n_drives, self.n_samples, fitted, board, periods),
        )

    @classmethod
    def of(cls, scan: Scan, settings: ScanSettings) -> Self:
        """Timing, and drives in chunks."""
        announce = wire.SetScan(
            request=0,
            configuration=0,
            n_drives=len(scan.drives),
            settling=round(settings.settling * 1e6),
            dead_time=round(settings.dead_time * 1e6),
            oversampling=settings.oversampling,
            prescaler=settings.prescaler,
            current_limit=round(settings.current_limit * 1e6),
        )
        chunks = _chunks(scan)
        packed = b"".join(map(wire.encode_payload, chunks))
        content = wire.encode_payload(announce) + packed
        mode = None
        if settings.chop_frequency:
            mode = wire.SetMode(0, 0, wire.DriveMode.CHOPPED, settings.chop_frequency, 0)
        content += wire.encode_payload(mode) if mode else b""
        identity = wire.crc16(content) or 1
        return cls(
            identity,
            replace(announce, configuration=identity),
            tuple(replace(chunk, configuration=identity) for chunk in chunks),
            wire.SetFormat(0, identity, settings.format),
            scan.n_samples,
            scan_time(len(scan.drives), scan.n_samples, settings),
            mode and replace(mode, configuration=identity),
        )


def _chunks(scan: Scan) -> list[wire.SetPattern]:
    drives = [
        wire.Drive(source, sink, mask)
        for (source, sink), mask in zip(scan.drives.tolist(), scan.masks.tolist(), strict=True)
    ]
    empty = len(wire.encode_payload(wire.SetPattern(0, 0, 0, ())))
    size = len(wire.encode_payload(wire.SetPattern(0, 0, 0, (wire.Drive(0, 0, 0),)))) - empty
    most = (wire.SCHEMA.to_device_bytes - 2 - empty) // size
    return [
        wire.SetPattern(0, 0, first, tuple(drives[first : first + most]))
        for first in range(0, len(drives), most)
    ]
