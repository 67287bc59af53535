"""Commands to a board that no link follows: asked until they are answered."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import TypeVar

from tomoskin.board.source.transport import Transport
from tomoskin.board.wire import Ack, Command, Decoder, Message, encode

M = TypeVar("M", bound=Message)


class Exchange:
    """Commands, one after the other, and what comes in between."""

    def __init__(self, transport: Transport) -> None:
        self.transport = transport
        self._decoder = Decoder()
        self._request = 200

    def ask(
        self, command: Command, kind: type[M], *, patience: float = 0.3, tries: int = 5
    ) -> M | None:
        """The answer, of a ``kind`` of message; None where ``tries`` of ``patience`` s bring none.

        An acknowledgement is one of this very command.
        """
        self._request = self._request % 255 + 1
        data = encode(replace(command, request=self._request))
        for _ in range(tries):
            self.transport.write(data)
            for message in self.listen(patience):
                others = isinstance(message, Ack) and message.request != self._request
                if isinstance(message, kind) and not others:
                    return message
        return None

    def listen(self, seconds: float) -> Iterator[Message]:
        """What comes within ``seconds``."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            data = self.transport.read(left)
            yield from self._decoder.feed(data, time.monotonic())
