"""The twin's board: its limits, what it refuses, and the scan that it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields, replace
from typing import Self

from tomoskin.board import source, wire
from tomoskin.twin.scanning import LIMITS

Verdict = tuple[wire.Result, int]
"""Result and detail of an ACK."""

Question = (
    wire.GetInfo | wire.GetBoard | wire.GetLosses | wire.GetScan | wire.GetPattern | wire.GetMode
)
"""What a host may ask at any time."""

Setting = wire.SetScan | wire.SetPattern | wire.SetFormat | wire.SetMode
"""What a host may set while nothing is scanned."""

PACKED = (wire.Format.PACKED, wire.Format.DRIVES_PACKED)
"""Formats whose samples have ten bits."""

OK: Verdict = (wire.Result.OK, 0)
_MAX_SETTLING = 100_000
_MOST_CONVERSIONS, _MOST_SAMPLE = 64, 0xFFFF
_OF_RECORD = ("adc_bits", "tick_rate", "max_drives", "max_samples", "limits", "converter")
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
    firmware: tuple[int, int, int] = (1, 3, 0)
    unique_id: bytes = b"twin\0\0\0\0"
    limits: wire.BoardLimits = LIMITS
    converter: source.Converter = source.BOARDS[source.DEFAULT_BOARD].converter

    @classmethod
    def of(cls, record: source.BoardRecord, needed: int, current: float, unique_id: bytes) -> Self:
        """A board of the table, of the smallest size that has the channels ``needed``."""
        channels = next((n for n in record.channels if n >= needed), record.channels[-1])
        own = {name: getattr(record, name) for name in _OF_RECORD}
        return cls(channels=channels, current=current, unique_id=unique_id, **own)

    @property
    def max_oversampling(self) -> int:
        """Conversions whose sum fits a sample."""
        return min(_MOST_CONVERSIONS, _MOST_SAMPLE // ((1 << self.adc_bits) - 1))

    def info(self, request: int) -> wire.Info:
        """The board's answer to GET_INFO."""
        return wire.Info(
            request=request,
            major=wire.SCHEMA.major,
            minor=wire.SCHEMA.minor,
            schema_hash=wire.SCHEMA.hash,
            firmware=bytes(self.firmware),
            reset=wire.Reset.POWER,
            channels=self.channels,
            adc_bits=self.adc_bits,
            max_oversampling=self.max_oversampling,
            max_drives=self.max_drives,
            max_samples=self.max_samples,
            tick_rate=round(self.tick_rate),
            current=round(self.current * 1e6),
            max_baud=1_000_000,
            unique_id=self.unique_id,
        )

    def check_scan(self, command: wire.SetScan) -> Verdict:
        """Whether a SET_SCAN is acceptable."""
        if command.n_drives > self.max_drives:
            return wire.Result.TOO_MANY_DRIVES, self.max_drives
        if round(self.current * 1e6) > command.current_limit:
            return wire.Result.CURRENT_TOO_HIGH, 0
        good = {
            "configuration": command.configuration > 0,
            "n_drives": command.n_drives > 0,
            "settling": command.settling <= _MAX_SETTLING,
            "oversampling": 1 <= command.oversampling <= self.max_oversampling,
            "prescaler": command.prescaler in source.PRESCALERS,
        }
        names = [field.name for field in fields(wire.SetScan)]
        wrong = next((name for name, fine in good.items() if not fine), None)
        return OK if wrong is None else (wire.Result.BAD_VALUE, names.index(wrong))

    def check_drives(self, command: wire.SetPattern, scan: wire.SetScan) -> Verdict:
        """Whether a SET_PATTERN fits the announced scan and this board."""
        if not command.drives or command.first + len(command.drives) > scan.n_drives:
            return wire.Result.BAD_VALUE, 2
        for number, drive in enumerate(command.drives, start=command.first):
            if drive.source == drive.sink:
                return wire.Result.SAME_ELECTRODE, number
            if max(drive.source, drive.sink) >= self.channels or drive.mask >> self.channels:
                return wire.Result.NO_SUCH_CHANNEL, number
        return OK

    def check_format(self, command: wire.SetFormat, scan: wire.SetScan) -> Verdict:
        """Whether a SET_FORMAT fits the announced scan and this converter."""
        fits = scan.oversampling == 1 and self.adc_bits == 10
        return OK if command.format not in PACKED or fits else (wire.Result.BAD_VALUE, 2)

    def check_order(self, command: wire.SetOrder, n_drives: int) -> Verdict:
        """Whether a SET_ORDER asks for drives that there are."""
        if (command.order == 0) != (not command.drives):
            return wire.Result.BAD_VALUE, 2
        return OK if max(command.drives, default=0) < n_drives else (wire.Result.BAD_VALUE, 3)

    def check_mode(self, command: wire.SetMode, scan: wire.SetScan) -> Verdict:
        """Whether a SET_MODE fits the announced scan and this board."""
        periods, frequency = command.periods, command.frequency
        if command.mode is wire.DriveMode.DIRECT:
            wrong = 3 if frequency else 4 if periods else None
            return OK if wrong is None else (wire.Result.BAD_VALUE, wrong)
        if frequency < self.limits.min_chop:
            return wire.Result.BAD_VALUE, 3
        if frequency > self.limits.max_chop:
            return wire.Result.CHOP_TOO_FAST, self.limits.max_chop
        shared = periods and scan.oversampling % (2 * periods) == 0
        return OK if shared else (wire.Result.BAD_VALUE, 4)

    def check_start(
        self,
        configuration: int,
        scan: wire.SetScan | None,
        drives: Sequence[wire.Drive | None],
        mode: wire.SetMode | None = None,
    ) -> Verdict:
        """Whether the scan that START names is complete, and not too fast."""
        if scan is None or configuration != scan.configuration:
            return wire.Result.WRONG_CONFIGURATION, 0
        if None in drives:
            return wire.Result.INCOMPLETE, list(drives).index(None)
        channels = [drive.mask.bit_count() for drive in drives if drive]
        most = self.max_samples // (2 if mode else 1)
        if sum(channels) > most:
            return wire.Result.TOO_MANY_SAMPLES, most
        if mode is None:
            return OK
        settings = source.ScanSettings(
            scan.oversampling, scan.settling / 1e6, self.current, self.adc_bits,
            scan.dead_time / 1e6, scan.prescaler,
        )  # fmt: skip
        limit = source.chop_limit(
            self.limits, settings, mode.periods, max(channels), self.tick_rate
        )
        return OK if mode.frequency <= limit else (wire.Result.CHOP_TOO_FAST, limit)


class HeldScanning:
    """The scan that a host has set on a ``board``, as far as it has come."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self.scan: wire.SetScan | None = None
        self.format = wire.Format.SIXTEEN
        self.mode: wire.SetMode | None = None
        """None: the drive is direct."""
        self.drives: list[wire.Drive | None] = []

    def set(self, command: Setting) -> Verdict:
        """Take over what the board accepts."""
        if isinstance(command, wire.SetScan):
            if (verdict := self._board.check_scan(command)) == OK:
                self.scan, self.format, self.mode = command, wire.Format.SIXTEEN, None
                self.drives = [None] * command.n_drives
            return verdict
        if self.scan is None or command.configuration != self.scan.configuration:
            return wire.Result.WRONG_CONFIGURATION, 0
        match command:
            case wire.SetPattern():
                if (verdict := self._board.check_drives(command, self.scan)) == OK:
                    end = command.first + len(command.drives)
                    self.drives[command.first : end] = command.drives
            case wire.SetFormat():
                if (verdict := self._board.check_format(command, self.scan)) == OK:
                    self.format = command.format
            case wire.SetMode():
                if (verdict := self._board.check_mode(command, self.scan)) == OK:
                    self.mode = command if command.mode is wire.DriveMode.CHOPPED else None
        return verdict

    def _own(self, command: wire.GetInfo | wire.GetBoard | wire.GetLosses) -> wire.Message:
        if isinstance(command, wire.GetLosses):
            return wire.Losses(command.request, 0, 0)
        if isinstance(command, wire.GetInfo):
            return self._board.info(command.request)
        return replace(self._board.limits, request=command.request)

    def answer(self, command: Question) -> wire.Message:
        """What the board is, or what is held, for a host that reads it back."""
        scan, request = self.scan, command.request
        if isinstance(command, wire.GetInfo | wire.GetBoard | wire.GetLosses):
            return self._own(command)
        if scan is None:
            return wire.Ack(
                request, wire.type_byte(type(command)), wire.Result.WRONG_CONFIGURATION, 0
            )
        if isinstance(command, wire.GetScan):
            return wire.HeldScan(*(request, *astuple(scan)[1:], self.format))
        if isinstance(command, wire.GetMode):
            mode = self.mode or wire.SetMode(0, 0, wire.DriveMode.DIRECT, 0, 0)
            return wire.HeldMode(
                request, scan.configuration, mode.mode, mode.frequency, mode.periods
            )
        if command.first >= scan.n_drives:
            return wire.Ack(request, wire.type_byte(wire.GetPattern), wire.Result.BAD_VALUE, 1)
        some = self.drives[command.first : command.first + _DRIVES_OF_PATTERN]
        drives = tuple(drive or wire.Drive(255, 255, 0) for drive in some)
        return wire.HeldPattern(request, scan.configuration, command.first, drives)
