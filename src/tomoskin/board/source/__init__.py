"""Where bytes come from, and the protocol session with the board behind them."""

from tomoskin.board.source.agreement import (
    BOARDS_SINCE as BOARDS_SINCE,
    LOSSES_SINCE as LOSSES_SINCE,
    current_damaged as current_damaged,
)
from tomoskin.board.source.boards import (
    BOARDS as BOARDS,
    DEFAULT_BOARD as DEFAULT_BOARD,
    BoardRecord as BoardRecord,
    Converter as Converter,
    FirmwareFiles as FirmwareFiles,
    board_named as board_named,
)
from tomoskin.board.source.clock import (
    TICK_RATES as TICK_RATES,
    ClockFit as ClockFit,
    ClockFitter as ClockFitter,
    ScanTimer as ScanTimer,
)
from tomoskin.board.source.link import Link as Link
from tomoskin.board.source.protocol_session import Received as Received
from tomoskin.board.source.questions import ask_info as ask_info, ask_losses as ask_losses
from tomoskin.board.source.serial import (
    SerialTransport as SerialTransport,
    list_ports as list_ports,
)
from tomoskin.board.source.settings import (
    PRESCALERS as PRESCALERS,
    Configuration as Configuration,
    ScanSettings as ScanSettings,
    Timing as Timing,
    choose_periods as choose_periods,
    chop_limit as chop_limit,
)
from tomoskin.board.source.transport import (
    Exchange as Exchange,
    Transport as Transport,
    open_source as open_source,
    read_options as read_options,
    source_names as source_names,
)
