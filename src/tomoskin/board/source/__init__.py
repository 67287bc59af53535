"""Where bytes come from, and the protocol session with the board behind them."""

from tomoskin.board.source.agreement import BOARDS_SINCE, current_damaged
from tomoskin.board.source.assembler import Received
from tomoskin.board.source.boards import (
    BOARDS,
    DEFAULT_BOARD,
    BoardRecord,
    Converter,
    FirmwareFiles,
    board_named,
)
from tomoskin.board.source.clock import TICK_RATES, ClockFit, ClockFitter, ScanTimer
from tomoskin.board.source.configuration import Configuration
from tomoskin.board.source.link import Link
from tomoskin.board.source.serial import SerialTransport, list_ports
from tomoskin.board.source.settings import (
    PRESCALERS,
    ScanSettings,
    Timing,
    choose_periods,
    chop_limit,
)
from tomoskin.board.source.transport import (
    Exchange,
    Transport,
    open_source,
    read_options,
    source_names,
)

__all__ = [
    "BOARDS",
    "BOARDS_SINCE",
    "DEFAULT_BOARD",
    "PRESCALERS",
    "TICK_RATES",
    "BoardRecord",
    "ClockFit",
    "ClockFitter",
    "Configuration",
    "Converter",
    "Exchange",
    "FirmwareFiles",
    "Link",
    "Received",
    "ScanSettings",
    "ScanTimer",
    "SerialTransport",
    "Timing",
    "Transport",
    "board_named",
    "choose_periods",
    "chop_limit",
    "current_damaged",
    "list_ports",
    "open_source",
    "read_options",
    "source_names",
]
