"""The twin's board: its limits, what it refuses, and the scan that it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tomoskin.source import PRESCALERS
from tomoskin.wire import (
    SCHEMA,
    Ack,
    Drive,
    Format,
    GetPattern,
    GetScan,
    HeldPattern,
    HeldScan,
    Info,
    Message,
    Reset,
    Result,
    SetFormat,
    SetPattern,
    SetScan,
    type_byte,
)

Verdict = tuple[Result, int]
"""Result and detail of an ACK."""

OK: Verdict = (Result.OK, 0)
_MAX_SETTLING = 100_000
_CONVERSIONS = (1, 64)
_DRIVES_OF_PATTERN = 9
"""Drives that a PATTERN holds at most."""


@dataclass(frozen=True)
class Board:
    """What the board is: ``current`` A, ``tick_rate`` Hz."""

    channels: int
    adc_bits: int
    current: float
    tick_rate: float
    max_drives: int = 128
    max_samples: int = 2000
    firmware: tuple[int, int, int] = (1, 1, 0)
    unique_id: bytes = b"twin\0\0\0\0"

    def info(self, request: int) -> Info:
        """The answer to GET_INFO."""
        return Info(
            request=request,
            major=SCHEMA.major,
            minor=SCHEMA.minor,
            schema_hash=SCHEMA.hash,
            firmware=bytes(self.firmware),
            reset=Reset.POWER,
            channels=self.channels,
            adc_bits=self.adc_bits,
            max_oversampling=_CONVERSIONS[1],
            max_drives=self.max_drives,
            max_samples=self.max_samples,
            tick_rate=round(self.tick_rate),
            current=round(self.current * 1e6),
            max_baud=1_000_000,
            unique_id=self.unique_id,
        )

    def check_scan(self, command: SetScan) -> Verdict:
        """Whether a SET_SCAN is acceptable."""
        if command.n_drives > self.max_drives:
            return Result.TOO_MANY_DRIVES, self.max_drives
        if round(self.current * 1e6) > command.current_limit:
            return Result.CURRENT_TOO_HIGH, 0
        low, high = _CONVERSIONS
        good = {
            "configuration": command.configuration > 0,
            "n_drives": command.n_drives > 0,
            "settling": command.settling <= _MAX_SETTLING,
            "oversampling": low <= command.oversampling <= high,
            "prescaler": command.prescaler in PRESCALERS,
        }
        names = [field.name for field in SCHEMA.by_name["SET_SCAN"].fields]
        wrong = next((name for name, fine in good.items() if not fine), None)
        return OK if wrong is None else (Result.BAD_VALUE, names.index(wrong))

    def check_drives(self, command: SetPattern, scan: SetScan | None) -> Verdict:
        """Whether a SET_PATTERN fits the announced scan and this board."""
        if scan is None or command.configuration != scan.configuration:
            return Result.WRONG_CONFIGURATION, 0
        if not command.drives or command.first + len(command.drives) > scan.n_drives:
            return Result.BAD_VALUE, 2
        for number, drive in enumerate(command.drives, start=command.first):
            if drive.source == drive.sink:
                return Result.SAME_ELECTRODE, number
            if max(drive.source, drive.sink) >= self.channels or drive.mask >> self.channels:
                return Result.NO_SUCH_CHANNEL, number
        return OK

    def check_format(self, command: SetFormat, scan: SetScan | None) -> Verdict:
        """Whether a SET_FORMAT fits the announced scan and this converter."""
        if scan is None or command.configuration != scan.configuration:
            return Result.WRONG_CONFIGURATION, 0
        fits = scan.oversampling == 1 and self.adc_bits == 10
        return OK if command.format is Format.SIXTEEN or fits else (Result.BAD_VALUE, 2)

    def check_start(
        self, configuration: int, scan: SetScan | None, drives: Sequence[Drive | None]
    ) -> Verdict:
        """Whether the scan that START names is complete."""
        if scan is None or configuration != scan.configuration:
            return Result.WRONG_CONFIGURATION, 0
        if None in drives:
            return Result.INCOMPLETE, list(drives).index(None)
        samples = sum(drive.mask.bit_count() for drive in drives if drive)
        return OK if samples <= self.max_samples else (Result.TOO_MANY_SAMPLES, self.max_samples)


class HeldScanning:
    """The scan that a host has set on a ``board``, as far as it has come."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self.scan: SetScan | None = None
        self.format = Format.SIXTEEN
        self.drives: list[Drive | None] = []

    def set(self, command: SetScan | SetPattern | SetFormat) -> Verdict:
        """Take over what the board accepts."""
        match command:
            case SetScan():
                verdict = self._board.check_scan(command)
                if verdict == OK:
                    self.scan, self.format = command, Format.SIXTEEN
                    self.drives = [None] * command.n_drives
            case SetPattern():
                verdict = self._board.check_drives(command, self.scan)
                if verdict == OK:
                    end = command.first + len(command.drives)
                    self.drives[command.first : end] = command.drives
            case SetFormat():
                verdict = self._board.check_format(command, self.scan)
                if verdict == OK:
                    self.format = command.format
        return verdict

    def answer(self, command: GetScan | GetPattern) -> Message:
        """What is held, for a host that reads it back."""
        scan, request = self.scan, command.request
        if scan is None:
            return Ack(request, type_byte(type(command)), Result.WRONG_CONFIGURATION, 0)
        if isinstance(command, GetScan):
            return HeldScan(
                request, scan.configuration, scan.n_drives, scan.settling, scan.dead_time,
                scan.oversampling, scan.prescaler, scan.current_limit, self.format,
            )  # fmt: skip
        if command.first >= scan.n_drives:
            return Ack(request, type_byte(GetPattern), Result.BAD_VALUE, 1)
        some = self.drives[command.first : command.first + _DRIVES_OF_PATTERN]
        drives = tuple(drive or Drive(255, 255, 0) for drive in some)
        return HeldPattern(request, scan.configuration, command.first, drives)
