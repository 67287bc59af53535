"""Where bytes come from, and the protocol session with the board behind them."""

from typing import Any

from tomoskin._moved import moved
from tomoskin.source.agreement import BOARDS_SINCE
from tomoskin.source.chopping import choose_periods, chop_limit
from tomoskin.source.command_queue import FrameCounters, SequenceFilter
from tomoskin.source.configuration import Configuration
from tomoskin.source.exchange import Exchange
from tomoskin.source.link import Link
from tomoskin.source.protocol_session import ProtocolSession, Stage
from tomoskin.source.registry import GROUP, open_source, read_options, source_names
from tomoskin.source.serial import Port, SerialTransport, list_ports
from tomoskin.source.settings import (
    PRESCALERS,
    ScanSettings,
    Timing,
    conversion_time,
    scan_time,
)
from tomoskin.source.transport import Played, Transport

__all__ = [
    "BOARDS_SINCE",
    "GROUP",
    "PRESCALERS",
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


def __getattr__(name: str) -> Any:
    return moved("source", name)
