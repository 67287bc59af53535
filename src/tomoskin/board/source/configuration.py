"""A scan as the commands that set it on a board."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

from tomoskin.board.source.settings import ScanSettings, scan_time
from tomoskin.board.wire import (
    SCHEMA,
    BoardLimits,
    Command,
    Drive,
    DriveMode,
    Format,
    GetMode,
    GetPattern,
    GetScan,
    SetFormat,
    SetMode,
    SetPattern,
    SetScan,
    Start,
    crc16,
    encode_payload,
)
from tomoskin.model.pattern import Scan

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
    scan: SetScan
    patterns: tuple[SetPattern, ...]
    format: SetFormat
    n_samples: int
    scan_time: float
    mode: SetMode | None = None
    """None: the drive is direct, as SET_SCAN leaves it."""

    def commands(self, minor: int) -> tuple[Command, ...]:
        """What sets it on a board of protocol 1.``minor``, reads it back, and starts it."""
        start = Start(0, self.identity)
        if minor < _FORMATS_SINCE:
            return (self.scan, *self.patterns, start)
        read_back = (GetPattern(0, pattern.first) for pattern in self.patterns)
        mode, held = ((self.mode,), (GetMode(0),)) if self.mode else ((), ())
        settings = (self.scan, *self.patterns, self.format, *mode)
        return (*settings, GetScan(0), *read_back, *held, start)

    @property
    def singly(self) -> bool:
        """Whether it asks for each drive in a message of its own."""
        return self.format.format in (Format.DRIVES, Format.DRIVES_PACKED)

    @cached_property
    def channels(self) -> tuple[int, ...]:
        """How many channels each drive reads."""
        drives = (drive for pattern in self.patterns for drive in pattern.drives)
        return tuple(drive.mask.bit_count() for drive in drives)

    def behind(self, question: Command) -> tuple[Command, ...]:
        """The commands that set what a GET_SCAN, GET_PATTERN or GET_MODE asks for."""
        if isinstance(question, GetMode):
            return (self.mode,) if self.mode else ()
        if isinstance(question, GetPattern):
            return tuple(pattern for pattern in self.patterns if pattern.first == question.first)
        return (self.scan, self.format)

    def on_board(
        self, fitted: ScanSettings, board: BoardLimits | None = None, periods: int = 0
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
        announce = SetScan(
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
        content = encode_payload(announce) + b"".join(encode_payload(chunk) for chunk in chunks)
        mode = None
        if settings.chop_frequency:
            mode = SetMode(0, 0, DriveMode.CHOPPED, settings.chop_frequency, 0)
        content += encode_payload(mode) if mode else b""
        identity = crc16(content) or 1
        return cls(
            identity,
            replace(announce, configuration=identity),
            tuple(replace(chunk, configuration=identity) for chunk in chunks),
            SetFormat(0, identity, settings.format),
            scan.n_samples,
            scan_time(len(scan.drives), scan.n_samples, settings),
            mode and replace(mode, configuration=identity),
        )


def _chunks(scan: Scan) -> list[SetPattern]:
    drives = [
        Drive(source, sink, mask)
        for (source, sink), mask in zip(scan.drives.tolist(), scan.masks.tolist(), strict=True)
    ]
    empty = len(encode_payload(SetPattern(0, 0, 0, ())))
    size = len(encode_payload(SetPattern(0, 0, 0, (Drive(0, 0, 0),)))) - empty
    most = (SCHEMA.to_device_bytes - 2 - empty) // size
    return [
        SetPattern(0, 0, first, tuple(drives[first : first + most]))
        for first in range(0, len(drives), most)
    ]
