"""Where bytes come from, and the protocol session with the board behind them."""

from tomoskin.board.source.agreement import BOARDS_SINCE
from tomoskin.board.source.chopping import choose_periods, chop_limit
from tomoskin.board.source.clock import TICK_RATES, ClockFit, ClockFitter
from tomoskin.board.source.command_queue import FrameCounters, SequenceFilter
from tomoskin.board.source.configuration import Configuration
from tomoskin.board.source.exchange import Exchange
from tomoskin.board.source.link import Link
from tomoskin.board.source.protocol_session import ProtocolSession, Stage
from tomoskin.board.source.registry import GROUP, open_source, read_options, source_names
from tomoskin.board.source.serial import Port, SerialTransport, list_ports
from tomoskin.board.source.settings import (
    PRESCALERS,
    ScanSettings,
    Timing,
    conversion_time,
    scan_time,
)
from tomoskin.board.source.transport import Played, Transport

__all__ = [
    "BOARDS_SINCE",
    "GROUP",
    "PRESCALERS",
    "TICK_RATES",
    "ClockFit",
    "ClockFitter",
    "Configuration",
    "Exchange",
    "FrameCounters",
    "Link",
    "Played",
    "Port",
    "ProtocolSession",
    "ScanSettings",
    "SequenceFilter",
    "SerialTransport",
    "Stage",
    "Timing",
    "Transport",
    "choose_periods",
    "chop_limit",
    "conversion_time",
    "list_ports",
    "open_source",
    "read_options",
    "scan_time",
    "source_names",
]
