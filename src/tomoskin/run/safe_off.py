"""Whether a board switches its current off when it should, as far as the protocol can say."""

from __future__ import annotations

from collections.abc import Iterator

from tomoskin.board.source import Configuration, Exchange, ScanSettings, Transport
from tomoskin.board.wire import (
    Ack,
    Command,
    Fault,
    FaultCode,
    Result,
    SafeOff,
    SetHeartbeat,
    Start,
    Stop,
)
from tomoskin.core import Frame, SourceError
from tomoskin.model.pattern import Scan

_ANSWER, _TRIES = 0.3, 5
_HEARTBEAT, _USUAL = 300, 2000
"""ms of silence that the board tolerates: while this is tried, and after reset."""

Look = tuple[str, str, str]
"""What was looked at; what is wrong with it, or nothing; what is to be said when it is right."""


def check_safe_off(transport: Transport, scan: Scan, settings: ScanSettings) -> Iterator[Look]:
    """STOP, a silent host, SAFE_OFF: frames end, and nothing starts again by itself.

    Frames stand for the current here, since only a drive is sampled; whether a switch really opens
    is what the channels' readings and the multimeter say. Raises SourceError without an answer.
    """
    board = Exchange(transport)
    configuration = Configuration.of(scan, settings)
    set_up: tuple[Command, ...] = (
        configuration.scan,
        *configuration.patterns,
        SetHeartbeat(0, _HEARTBEAT),
    )
    start = Start(0, configuration.identity)
    _asked(board, Stop(0))
    for command in set_up:
        _accepted(_asked(board, command), command, transport)
    _accepted(_asked(board, start), start, transport)
    _asked(board, Stop(0))
    late = any(isinstance(m, Frame) for m in board.listen(4 * configuration.scan_time))
    yield "stop", "frames continue after STOP" if late else "", "no frame after STOP"
    _accepted(_asked(board, start), start, transport)
    heard = board.listen(5e-3 * _HEARTBEAT)
    silent = any(isinstance(m, Fault) and m.code is FaultCode.HOST_SILENT for m in heard)
    yield (
        "silence",
        "" if silent else f"frames continue {_HEARTBEAT} ms after the last message of the host",
        f"no frame {_HEARTBEAT} ms after the last message of the host",
    )
    _asked(board, SetHeartbeat(0, _USUAL))
    _asked(board, SafeOff(0))
    forgotten = _asked(board, start).result is Result.WRONG_CONFIGURATION
    _asked(board, Stop(0))
    yield (
        "safe off",
        "" if forgotten else "START is accepted after SAFE_OFF",
        "nothing starts after SAFE_OFF until the board is set up again",
    )


def _asked(board: Exchange, command: Command) -> Ack:
    answer = board.ask(command, Ack, patience=_ANSWER, tries=_TRIES)
    if answer is None:
        raise SourceError(
            f"no answer to {type(command).__name__} for {_ANSWER * _TRIES:g} s",
            where=board.transport.name,
            hint="start the check again; a board that often stops answering may have a weak supply",
        )
    return answer


def _accepted(answer: Ack, command: Command, transport: Transport) -> None:
    if answer.result is not Result.OK:
        raise SourceError(
            f"the board refused {type(command).__name__}: {answer.result.name} ({answer.detail})",
            where=transport.name,
        )
