"""A board that is asked without a link: again while it is silent, and for its own answer only."""

from __future__ import annotations

import threading

import pytest

from tomoskin.board.source import Exchange
from tomoskin.board.wire import SCHEMA, Ack, Deframer, Result, Stop, decode_payload, encode


class Board:
    """Answers from the ``late``-th time on, first to another command."""

    name = "board"

    def __init__(self, late):
        self.late, self.heard, self._out = late, [], b""

    def read(self, timeout):
        out, self._out = self._out, b""
        if not out:
            threading.Event().wait(timeout)
        return out

    def write(self, data):
        (payload,) = Deframer(SCHEMA.to_device_bytes).feed(data)
        command = decode_payload(payload, 0.0)
        self.heard.append(command.request)
        if len(self.heard) >= self.late:
            for request in (command.request - 1, command.request):
                result = Result.OK if request == command.request else Result.BAD_VALUE
                self._out += encode(Ack(request, 1, result, 0))

    def close(self):
        pass


@pytest.mark.parametrize("late", [1, 3])
def test_a_command_is_asked_again_under_its_number(late):
    board = Board(late)
    exchange = Exchange(board)
    first = exchange.ask(Stop(0), Ack, patience=0.02)
    assert (first.request, first.result) == (board.heard[0], Result.OK)
    assert board.heard == [first.request] * late
    assert exchange.ask(Stop(0), Ack, patience=0.02).request != first.request


def test_a_silent_board_is_asked_so_often():
    board = Board(99)
    assert Exchange(board).ask(Stop(0), Ack, patience=0.001, tries=4) is None
    assert len(board.heard) == 4
