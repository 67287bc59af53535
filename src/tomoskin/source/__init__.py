"""Where bytes come from, and the conversation with the board behind them."""

from tomoskin.source.configuration import Configuration
from tomoskin.source.conversation import Conversation, Stage
from tomoskin.source.gate import FrameCounters, FrameGate
from tomoskin.source.link import Link
from tomoskin.source.ports import Port, list_ports
from tomoskin.source.registry import GROUP, open_source, read_options, source_names
from tomoskin.source.serial import SerialTransport
from tomoskin.source.settings import (
    PRESCALERS,
    ScanSettings,
    Timing,
    conversion_time,
    scan_time,
)
from tomoskin.source.transport import Played, Transport

__all__ = [
    "GROUP",
    "PRESCALERS",
    "Configuration",
    "Conversation",
    "FrameCounters",
    "FrameGate",
    "Link",
    "Played",
    "Port",
    "ScanSettings",
    "SerialTransport",
    "Stage",
    "Timing",
    "Transport",
    "conversion_time",
    "list_ports",
    "open_source",
    "read_options",
    "scan_time",
    "source_names",
]
