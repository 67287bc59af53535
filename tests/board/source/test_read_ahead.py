"""Bytes are fetched while nobody reads, up to a bound, and an error comes after the last byte."""

from __future__ import annotations

import queue
import threading

import pytest

from tomoskin.board.source.transport import ReadAhead

PATIENCE = 30.0


class Port:
    """Gives what is put into it, one after the other; ``asked`` is set when it is waited for."""

    def __init__(self) -> None:
        self._given: queue.Queue[bytes | Exception] = queue.Queue()
        self.fetched = 0
        self.went = threading.Condition()

    def give(self, *items: bytes | Exception) -> None:
        for item in items:
            self._given.put(item)

    def fetch(self) -> bytes:
        item = self._given.get()
        with self.went:
            self.fetched += 1
            self.went.notify_all()
        if isinstance(item, Exception):
            raise item
        return item

    def cancel(self) -> None:
        self._given.put(b"")

    def until(self, fetched: int) -> None:
        with self.went:
            assert self.went.wait_for(lambda: self.fetched >= fetched, PATIENCE)


def test_what_came_meanwhile_is_read_at_once_and_in_order() -> None:
    port = Port()
    ahead = ReadAhead(port.fetch, port.cancel)
    port.give(b"a")
    assert ahead.read(PATIENCE) == b"a"
    port.give(b"b", b"c", b"d", b"")
    port.until(5)
    assert ahead.read(PATIENCE) == b"bcd"
    assert ahead.waited > 0
    assert ahead.read(0.0) == b""
    ahead.close()


def test_an_error_is_raised_after_the_last_byte_and_again() -> None:
    port = Port()
    ahead = ReadAhead(port.fetch, port.cancel)
    port.give(b"last", OSError("gone"))
    assert ahead.read(PATIENCE) == b"last"
    for _ in range(2):
        with pytest.raises(OSError, match="gone"):
            ahead.read(PATIENCE)
    ahead.close()


def test_no_more_is_fetched_than_has_room() -> None:
    port = Port()
    ahead = ReadAhead(port.fetch, port.cancel, most=4)
    port.give(b"1", b"2345", b"6")
    assert ahead.read(PATIENCE)[:1] == b"1"
    port.until(2)
    assert ahead.read(PATIENCE)[-1:] in (b"5", b"6")
    port.until(3)
    ahead.close()


def test_closed_while_nothing_comes_and_before_anything_was_read() -> None:
    port = Port()
    ahead = ReadAhead(port.fetch, port.cancel)
    ahead.close()
    assert ahead.read(PATIENCE) == b""
    waiting = ReadAhead(port.fetch, port.cancel)
    assert waiting.read(0.0) == b""
    waiting.close()
    assert port.fetched == 1
