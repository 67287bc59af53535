"""Whether a board switches its current off when it should, as far as the protocol can say."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

from tomoskin.core import Frame, SourceError
from tomoskin.pattern import Scan
from tomoskin.source import Configuration, ScanSettings, Transport
from tomoskin.wire import (
    Ack,
    Command,
    Decoder,
    Fault,
    FaultCode,
    Message,
    Result,
    SafeOff,
    SetHeartbeat,
    Start,
    Stop,
    encode,
)

_ANSWER, _TRIES = 0.3, 5
_HEARTBEAT, _USUAL = 300, 2000
"""ms of silence that the board tolerates: while this is tried, and after reset."""

Look = tuple[str, str, str]
"""What was looked at; what is wrong with it, or nothing; what is to be said when it is right."""


class _Talk:
    """Commands, one after the other, and what comes in between."""

    def __init__(self, transport: Transport) -> None:
        self._transport = transport
        self._decoder = Decoder()
        self._request = 200

    def ask(self, command: Command) -> Ack:
        """The answer; SourceError where none comes."""
        self._request = self._request % 255 + 1
        data = encode(replace(command, request=self._request))
        for _ in range(_TRIES):
            self._transport.write(data)
            for message in self.listen(_ANSWER):
                if isinstance(message, Ack) and message.request == self._request:
                    return message
        raise SourceError(
            f"no answer to {type(command).__name__} for {_ANSWER * _TRIES:g} s",
            where=self._transport.name,
            hint="start the check again; a board that often falls silent has a weak supply",
        )

    def listen(self, seconds: float) -> Iterator[Message]:
        """What comes within ``seconds``."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            data = self._transport.read(left)
            yield from self._decoder.feed(data, time.monotonic())


def check_safe_off(transport: Transport, scan: Scan, settings: ScanSettings) -> Iterator[Look]:
    """STOP, a silent host, SAFE_OFF: frames end, and nothing starts again by itself.

    Frames stand for the current here, since only a drive is sampled; whether a switch really opens
    is what the channels' readings and the multimeter say. Raises SourceError without an answer.
    """
    talk = _Talk(transport)
    configuration = Configuration.of(scan, settings)
    set_up: tuple[Command, ...] = (
        configuration.scan,
        *configuration.patterns,
        SetHeartbeat(0, _HEARTBEAT),
    )
    start = Start(0, configuration.identity)
    talk.ask(Stop(0))
    for command in set_up:
        _accepted(talk.ask(command), command, transport)
    _accepted(talk.ask(start), start, transport)
    talk.ask(Stop(0))
    late = any(isinstance(m, Frame) for m in talk.listen(4 * configuration.scan_time))
    yield "stop", "frames go on after STOP" if late else "", "no frame after STOP"
    _accepted(talk.ask(start), start, transport)
    heard = talk.listen(5e-3 * _HEARTBEAT)
    silent = any(isinstance(m, Fault) and m.code is FaultCode.HOST_SILENT for m in heard)
    yield (
        "silence",
        "" if silent else f"the board goes on {_HEARTBEAT} ms after its host fell silent",
        f"off {_HEARTBEAT} ms after its host fell silent",
    )
    talk.ask(SetHeartbeat(0, _USUAL))
    talk.ask(SafeOff(0))
    forgotten = talk.ask(start).result is Result.WRONG_CONFIGURATION
    talk.ask(Stop(0))
    yield (
        "safe off",
        "" if forgotten else "START is accepted after SAFE_OFF",
        "nothing starts after SAFE_OFF until it is set anew",
    )


def _accepted(answer: Ack, command: Command, transport: Transport) -> None:
    if answer.result is not Result.OK:
        raise SourceError(
            f"the board refused {type(command).__name__}: {answer.result.name} ({answer.detail})",
            where=transport.name,
        )
