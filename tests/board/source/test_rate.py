"""A line that is too fast for its cable: the link falls back, and finds a reset board again."""

from __future__ import annotations

import pytest

from board.source.boards import HELLO, ManualClock, ScriptedBoard, events, frame_of, frames, linked
from tomoskin.board.source import Link
from tomoskin.board.source.agreement import RATES, RateFollower
from tomoskin.board.wire import Counters, SetBaud, encode


class Cable(ScriptedBoard):
    """Damages every third message above ``limit`` Bd; unheard where the two ends differ in rate."""

    def __init__(self, clock: ManualClock, limit: int) -> None:
        super().__init__(clock)
        self.rate = self.board_rate = RATES[0]
        self.next_rate = 0
        self.limit, self.said, self.obeys = limit, 0, True

    def use_rate(self, rate: int) -> None:
        self.rate = rate

    def read(self, timeout: float) -> bytes:
        data = super().read(timeout)
        heard = self.rate == self.board_rate
        if data and self.next_rate:  # as soon as the answer is sent
            self.board_rate, self.next_rate = self.next_rate, 0
        self.said += bool(data)
        if not data or not heard:
            return b""
        damaged = self.rate > self.limit and self.said % 3 == 0
        return bytes([data[0], data[1] ^ 0x55, *data[2:]]) if damaged else data

    def write(self, data: bytes) -> None:
        if self.rate != self.board_rate:
            return
        before = len(self.commands)
        super().write(data)
        for command in self.commands[before:]:
            if isinstance(command, SetBaud) and self.obeys:
                self.next_rate = command.baud

    def reset(self) -> None:
        self.board_rate = RATES[0]
        self.say(HELLO)


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


def scan(link: Link, board: Cable, most: int) -> list:
    """Frames from the board, and what the link makes of them."""
    items = []
    for number in range(most):
        if link.running and not board._queue:
            board.say(encode(frame_of(link, number)))
        items += link.poll(0.01)
    return items


@pytest.mark.parametrize(
    ("limit", "rate"), [(1_000_000, 1_000_000), (500_000, 500_000), (9600, 250_000)]
)
def test_it_falls_back_until_the_line_is_clean(clock: ManualClock, limit: int, rate: int) -> None:
    board = Cable(clock, limit)
    link = linked(board, clock)
    items = scan(link, board, 1500)
    assert board.rate == board.board_rate == rate
    said = [event.text for event in events(items) if event.kind == "rate"]
    assert len(said) == RATES.index(rate)
    assert all(f"{slower:,} Bd" in text for slower, text in zip(RATES[1:], said, strict=False))
    assert len(frames(items[-100:])) > 50


def test_a_board_that_is_reset_after_that_is_found_again(clock: ManualClock) -> None:
    board = Cable(clock, 500_000)
    link = linked(board, clock)
    scan(link, board, 400)
    assert board.rate == 500_000
    board.reset()
    board.limit = RATES[0]
    for _ in range(1000):
        link.poll(0.05)
        if board.rate == RATES[0] and link.running and not link.session.is_silent:
            break
    assert frames(scan(link, board, 100))
    assert board.rate == board.board_rate == RATES[0]


class Forgetful(Cable):
    """Its first answer to a change of rate is lost, and so it goes back."""

    asked: tuple[SetBaud, ...] = ()

    def answer(self, command: object) -> list[object]:
        if isinstance(command, SetBaud):
            self.asked = (*self.asked, command)
            self.obeys = len(self.asked) > 1
            if not self.obeys:
                return []
        return super().answer(command)


def test_a_lost_answer_to_the_change_is_asked_for_anew(clock: ManualClock) -> None:
    board = Forgetful(clock, 500_000)
    link = linked(board, clock)
    items = scan(link, board, 1500)
    numbers = [command.request for command in board.asked]
    assert len(set(numbers)) == len(numbers) >= 2
    assert board.rate == board.board_rate == 500_000
    assert frames(items[-50:])


def test_a_few_damaged_messages_are_no_reason() -> None:
    follower = RateFollower(Cable(ManualClock(), RATES[0]))
    for k in range(1, 20):
        assert follower.slower(Counters(messages=50 * k, checksum=2 * k), running=True) is None
    assert follower.slower(Counters(messages=960, checksum=60), running=True) == RATES[1]


def test_below_the_slowest_rate_there_is_none() -> None:
    cable = Cable(ManualClock(), RATES[0])
    cable.rate = RATES[-1]
    assert RateFollower(cable).slower(Counters(messages=10, torn=40), running=True) is None
