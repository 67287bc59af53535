"""The messages as frozen records; their names, fields and order are the schema's."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.board.wire.packing import pack, unpack
from tomoskin.core import Frame


class Result(IntEnum):
    """The outcome of a command."""

    OK = 0
    UNKNOWN_COMMAND = 1
    BAD_LENGTH = 2
    BAD_VALUE = 3
    SAME_ELECTRODE = 4
    NO_SUCH_CHANNEL = 5
    TOO_MANY_DRIVES = 6
    TOO_MANY_SAMPLES = 7
    WRONG_CONFIGURATION = 8
    INCOMPLETE = 9
    BUSY = 10
    CURRENT_TOO_HIGH = 11
    CHOP_TOO_FAST = 12


class FaultCode(IntEnum):
    """Why the board went to its safe state by itself."""

    HOST_SILENT = 1
    WATCHDOG = 2
    BROWN_OUT = 3
    CURRENT_TOO_LONG = 4
    SWITCH_REFUSED = 5
    CONVERTER = 6
    INTERNAL = 7


class Reset(IntEnum):
    """Why the board started anew."""

    UNKNOWN = 0
    POWER = 1
    EXTERNAL = 2
    BROWN_OUT = 3
    WATCHDOG = 4


class Format(IntEnum):
    """How a frame holds its samples."""

    SIXTEEN = 0
    PACKED = 1


class DriveMode(IntEnum):
    """How a pair of electrodes is driven."""

    DIRECT = 0
    CHOPPED = 1


class FrameFlag(IntFlag):
    """The bits of ``Frame.flags``."""

    FIRST = 1
    DROPPED = 2


@dataclass(frozen=True, slots=True)
class Drive:
    """One drive: source and sink channel, and bit e of ``mask`` set where e is sampled."""

    source: int
    sink: int
    mask: int


@dataclass(frozen=True, slots=True)
class Hello:
    """The board is here and idle; versions and schema hash for the first check."""

    major: int
    minor: int
    schema_hash: int


@dataclass(frozen=True, slots=True)
class Info:
    """What the board is and can do: ``tick_rate`` Hz, ``current`` µA, ``max_baud`` Bd."""

    request: int
    major: int
    minor: int
    schema_hash: int
    firmware: bytes
    reset: Reset
    channels: int
    adc_bits: int
    max_oversampling: int
    max_drives: int
    max_samples: int
    tick_rate: int
    current: int
    max_baud: int
    unique_id: bytes


@dataclass(frozen=True, slots=True)
class Ack:
    """Outcome of a command; ``command`` is its type byte."""

    request: int
    command: int
    result: Result
    detail: int


@dataclass(frozen=True, slots=True)
class Fault:
    """The board went to its safe state by itself."""

    ticks: int
    code: FaultCode
    detail: int


@dataclass(frozen=True, slots=True)
class HeldScan:
    """What the board holds of SET_SCAN and SET_FORMAT."""

    request: int
    configuration: int
    n_drives: int
    settling: int
    dead_time: int
    oversampling: int
    prescaler: int
    current_limit: int
    format: Format


@dataclass(frozen=True, slots=True)
class HeldPattern:
    """Drives ``first``, ``first`` + 1, … that the board holds."""

    request: int
    configuration: int
    first: int
    drives: tuple[Drive, ...]


@dataclass(frozen=True, slots=True)
class PackedFrame:
    """A frame as it is sent packed: ``samples`` (n,) of uint8. Decoders make frames of it."""

    sequence: int
    ticks: int
    host_time: float
    configuration: int
    flags: int
    drops: int
    samples: NDArray[np.uint8]

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """Pack a frame, whose samples must be below 1,024."""
        return cls(
            frame.sequence, frame.ticks, frame.host_time, frame.configuration, frame.flags,
            frame.drops, pack(frame.samples),
        )  # fmt: skip

    @property
    def frame(self) -> Frame:
        """The frame that it stands for."""
        return Frame(
            self.sequence, self.ticks, self.host_time, self.configuration, self.flags,
            self.drops, unpack(self.samples),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class ChoppedFrame:
    """A frame of the alternating drive as it is sent: ``samples`` (2 n,) of uint16, for each sample
    difference and sum. Decoders make frames of it."""

    sequence: int
    ticks: int
    host_time: float
    configuration: int
    flags: int
    drops: int
    samples: NDArray[np.uint16]

    @classmethod
    def of(cls, frame: Frame) -> Self:
        """The same frame with sums."""
        assert frame.sums is not None
        both = np.column_stack([frame.samples, frame.sums]).astype(np.uint16).ravel()
        return cls(
            frame.sequence, frame.ticks, frame.host_time, frame.configuration, frame.flags,
            frame.drops, both,
        )  # fmt: skip

    @property
    def frame(self) -> Frame:
        """The frame that it stands for."""
        return Frame(
            self.sequence, self.ticks, self.host_time, self.configuration, self.flags,
            self.drops, self.samples[::2], self.samples[1::2],
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class BoardLimits:
    """Which board it is, and the bounds of its alternating drive.

    ``name``: 24 bytes of UTF-8, filled up with zeros; ``min_chop``, ``max_chop`` Hz; what half a
    period takes, ns: ``half`` once, ``sample`` for each channel, ``conversion`` and ``clock`` times
    the prescaler for each conversion.
    """

    request: int
    name: bytes
    min_chop: int
    max_chop: int
    half: int
    sample: int
    conversion: int
    clock: int

    @property
    def text(self) -> str:
        """The name of the limit, for people."""
        return self.name.rstrip(b"\0").decode(errors="replace")


@dataclass(frozen=True, slots=True)
class HeldMode:
    """What the board holds of SET_MODE."""

    request: int
    configuration: int
    mode: DriveMode
    frequency: int
    periods: int


@dataclass(frozen=True, slots=True)
class GetInfo:
    """Ask for :class:`Info`."""

    request: int


@dataclass(frozen=True, slots=True)
class Ping:
    """Tell the board that the host is alive."""

    request: int


@dataclass(frozen=True, slots=True)
class Stop:
    """Stop scanning, all channels high-impedance."""

    request: int


@dataclass(frozen=True, slots=True)
class SafeOff:
    """As :class:`Stop`, and forget the configuration."""

    request: int


@dataclass(frozen=True, slots=True)
class SetScan:
    """Begin a configuration: ``settling`` and ``dead_time`` µs, ``current_limit`` µA."""

    request: int
    configuration: int
    n_drives: int
    settling: int
    dead_time: int
    oversampling: int
    prescaler: int
    current_limit: int


@dataclass(frozen=True, slots=True)
class SetPattern:
    """Set drives ``first``, ``first`` + 1, … of the configuration."""

    request: int
    configuration: int
    first: int
    drives: tuple[Drive, ...]


@dataclass(frozen=True, slots=True)
class Start:
    """Scan and send frames."""

    request: int
    configuration: int


@dataclass(frozen=True, slots=True)
class SetBaud:
    """Change the serial rate to ``baud`` Bd."""

    request: int
    baud: int


@dataclass(frozen=True, slots=True)
class SetHeartbeat:
    """Host silence tolerated while scanning, ``interval`` ms."""

    request: int
    interval: int


@dataclass(frozen=True, slots=True)
class GetScan:
    """Ask for :class:`HeldScan`."""

    request: int


@dataclass(frozen=True, slots=True)
class GetPattern:
    """Ask for :class:`HeldPattern` from drive ``first`` on."""

    request: int
    first: int


@dataclass(frozen=True, slots=True)
class SetFormat:
    """How frames hold their samples."""

    request: int
    configuration: int
    format: Format


@dataclass(frozen=True, slots=True)
class GetBoard:
    """Ask for :class:`BoardLimits`."""

    request: int


@dataclass(frozen=True, slots=True)
class SetMode:
    """How pairs are driven: ``frequency`` Hz and ``periods`` of the alternating drive."""

    request: int
    configuration: int
    mode: DriveMode
    frequency: int
    periods: int


@dataclass(frozen=True, slots=True)
class GetMode:
    """Ask for :class:`HeldMode`."""

    request: int


Command = (
    GetInfo | Ping | Stop | SafeOff | SetScan | SetPattern | Start | SetBaud | SetHeartbeat
    | GetScan | GetPattern | SetFormat | GetBoard | SetMode | GetMode
)  # fmt: skip
"""Messages to the device."""

Report = (
    Hello | Info | Ack | Fault | HeldScan | HeldPattern | BoardLimits | HeldMode
    | Frame | PackedFrame | ChoppedFrame
)  # fmt: skip
"""Messages from the device."""

Message = Command | Report

RECORDS: dict[str, type[Message]] = {
    "HELLO": Hello,
    "INFO": Info,
    "ACK": Ack,
    "FAULT": Fault,
    "SCAN": HeldScan,
    "PATTERN": HeldPattern,
    "BOARD": BoardLimits,
    "MODE": HeldMode,
    "FRAME": Frame,
    "FRAME_PACKED": PackedFrame,
    "FRAME_CHOPPED": ChoppedFrame,
    "GET_INFO": GetInfo,
    "PING": Ping,
    "STOP": Stop,
    "SAFE_OFF": SafeOff,
    "SET_SCAN": SetScan,
    "SET_PATTERN": SetPattern,
    "START": Start,
    "SET_BAUD": SetBaud,
    "SET_HEARTBEAT": SetHeartbeat,
    "GET_SCAN": GetScan,
    "GET_PATTERN": GetPattern,
    "SET_FORMAT": SetFormat,
    "GET_BOARD": GetBoard,
    "SET_MODE": SetMode,
    "GET_MODE": GetMode,
}
"""Record of each message of the schema."""

STRUCTS: dict[str, type[Drive]] = {"drive": Drive}
"""Record of each repeated group."""

ENUMS: dict[str, type[IntEnum] | type[IntFlag]] = {
    "result": Result,
    "fault": FaultCode,
    "reset": Reset,
    "format": Format,
    "drive_mode": DriveMode,
    "flag": FrameFlag,
}
"""Python side of each enumeration."""
