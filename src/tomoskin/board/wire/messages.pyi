# The records of the wire protocol. Made from protocol.toml by
# scripts/firmware_header.py: change that file, not this one.
from dataclasses import dataclass
from enum import Enum, IntEnum, IntFlag
from typing import Any

from tomoskin.core import DriveSamples, Frame

FRAMES: dict[str, type]
RECORDS: dict[str, type[Any]]
STRUCTS: dict[str, type[Any]]
ENUMS: dict[str, type[Enum]]

def class_name(name: str) -> str: ...

class Named:
    name: bytes
    @property
    def text(self) -> str: ...

class Result(IntEnum):
    """Outcome of a command."""

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
    NOT_SINGLY = 13
    DRIVEN_REFERENCE = 14

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
    """Why the board started."""

    UNKNOWN = 0
    POWER = 1
    EXTERNAL = 2
    BROWN_OUT = 3
    WATCHDOG = 4

class Format(IntEnum):
    """How a frame holds its samples."""

    SIXTEEN = 0
    PACKED = 1
    DRIVES = 2
    DRIVES_PACKED = 3

class DriveMode(IntEnum):
    """How a pair of electrodes is driven."""

    DIRECT = 0
    CHOPPED = 1

class FrameFlag(IntFlag):
    """Bits of a frame's flags."""

    FIRST = 1
    DROPPED = 2
    LATE = 4
    DEAF = 8

@dataclass(frozen=True, slots=True)
class Drive:
    """One drive of the scan."""

    source: int
    sink: int
    mask: int

@dataclass(frozen=True, slots=True)
class Hello:
    """I am here and idle."""

    major: int
    minor: int
    schema_hash: int

@dataclass(frozen=True, slots=True)
class Info:
    """Answer to GET_INFO: what the board is and can do."""

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
    """Answer to every command but GET_INFO."""

    request: int
    command: int
    result: Result
    detail: int

@dataclass(frozen=True, slots=True)
class Fault:
    """The board has gone to its safe state by itself: all channels high-impedance, scan stopped."""

    ticks: int
    code: FaultCode
    detail: int

@dataclass(frozen=True, slots=True)
class HeldScan:
    """Answer to GET_SCAN: what SET_SCAN and SET_FORMAT have set."""

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
    """Answer to GET_PATTERN: some drives of the configuration, at most 9."""

    request: int
    configuration: int
    first: int
    drives: tuple[Drive, ...]

@dataclass(frozen=True, slots=True)
class BoardLimits(Named):
    """Answer to GET_BOARD: which board it is, and the bounds of its alternating drive."""

    request: int
    name: bytes
    min_chop: int
    max_chop: int
    half: int
    sample: int
    conversion: int
    clock: int

@dataclass(frozen=True, slots=True)
class HeldMode:
    """Answer to GET_MODE: what SET_MODE has set."""

    request: int
    configuration: int
    mode: DriveMode
    frequency: int
    periods: int

@dataclass(frozen=True, slots=True)
class Losses:
    """Answer to GET_LOSSES: what the board has lost since power came up, modulo 65,536."""

    request: int
    conversions: int
    bytes: int

@dataclass(frozen=True, slots=True)
class GetInfo:
    """Ask for INFO."""

    request: int

@dataclass(frozen=True, slots=True)
class Ping:
    """Heartbeat: the host is alive."""

    request: int

@dataclass(frozen=True, slots=True)
class Stop:
    """Stop scanning."""

    request: int

@dataclass(frozen=True, slots=True)
class SafeOff:
    """As STOP, and forget the configuration: nothing drives current until it is set again."""

    request: int

@dataclass(frozen=True, slots=True)
class SetScan:
    """Begin a new configuration: timing and number of drives."""

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
    """Set some drives of the configuration."""

    request: int
    configuration: int
    first: int
    drives: tuple[Drive, ...]

@dataclass(frozen=True, slots=True)
class Start:
    """Scan and send frames until STOP or host silence."""

    request: int
    configuration: int

@dataclass(frozen=True, slots=True)
class SetBaud:
    """Change the serial rate after the ACK."""

    request: int
    baud: int

@dataclass(frozen=True, slots=True)
class SetHeartbeat:
    """Host silence that the board tolerates while scanning (2,000 ms after reset)."""

    request: int
    interval: int

@dataclass(frozen=True, slots=True)
class GetScan:
    """Ask for SCAN."""

    request: int

@dataclass(frozen=True, slots=True)
class GetPattern:
    """Ask for PATTERN, as GET_SCAN for SCAN."""

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
    """Ask for BOARD."""

    request: int

@dataclass(frozen=True, slots=True)
class SetMode:
    """How pairs are driven."""

    request: int
    configuration: int
    mode: DriveMode
    frequency: int
    periods: int

@dataclass(frozen=True, slots=True)
class GetMode:
    """Ask for MODE, as GET_SCAN for SCAN."""

    request: int

@dataclass(frozen=True, slots=True)
class SetOrder:
    """Which drives are scanned, again and again, from the end of the drive under way on."""

    request: int
    configuration: int
    order: int
    drives: bytes

@dataclass(frozen=True, slots=True)
class GetLosses:
    """Ask for LOSSES."""

    request: int

Command = (
    GetInfo
    | Ping
    | Stop
    | SafeOff
    | SetScan
    | SetPattern
    | Start
    | SetBaud
    | SetHeartbeat
    | GetScan
    | GetPattern
    | SetFormat
    | GetBoard
    | SetMode
    | GetMode
    | SetOrder
    | GetLosses
)

_Report = Hello | Info | Ack | Fault | HeldScan | HeldPattern | BoardLimits | HeldMode | Losses

Message = Command | _Report | Frame | DriveSamples
