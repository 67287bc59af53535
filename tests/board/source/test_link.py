"""Frames and what goes wrong with them, once the board scans."""

from dataclasses import replace

import numpy as np
import pytest

from board.source.boards import (
    BOARD,
    HELLO,
    SCAN,
    SET_UP,
    ManualClock,
    ScriptedBoard,
    events,
    frame_of,
    frames,
    linked,
    poll_until,
    twin_transport,
)
from tomoskin.board.source import Transport
from tomoskin.board.source.command_queue import FrameCounters
from tomoskin.board.wire import Fault, FaultCode, FrameFlag, encode
from tomoskin.core import SourceError


@pytest.fixture
def clock():
    return ManualClock()


@pytest.fixture
def board(clock):
    return ScriptedBoard(clock)


@pytest.fixture
def link(board, clock):
    link = linked(board, clock)
    link.connect()
    return link


def drain(link, board):
    items = []
    while board._queue:
        items += link.poll(0.01)
    return items


def test_frames_of_the_twin_arrive_whole_in_order_and_at_the_scans_rate(clock):
    transport = twin_transport(clock)
    assert isinstance(transport, Transport)
    with linked(transport, clock) as link:
        got = frames(poll_until(link, lambda items: len(frames(items)) == 50))
        assert [frame.sequence for frame in got] == list(range(50))
        for number, frame in enumerate(got):
            assert np.array_equal(frame.samples, np.arange(48) + number)
        period = 8 * (200e-6 + 5e-6) + 48 * 4 * 13 * 64 / 16e6
        ticks = np.diff([frame.ticks for frame in got])
        assert ticks.mean() == pytest.approx(period * 250e3, rel=1e-3)
        times = np.diff([frame.host_time for frame in got])
        assert times == pytest.approx(np.full(49, period), rel=1e-6)
        assert link.counters.corrupt == 0
        assert transport.device.driving
    assert not transport.device.driving


def test_gaps_are_events_with_the_number_lost(link, board):
    board.say(*(frame_of(link, n) for n in (0, 1, 5, 6, 8)))
    items = drain(link, board)
    assert [f.sequence for f in frames(items)] == [0, 1, 5, 6, 8]
    assert [(e.kind, e.text) for e in events(items)] == [
        ("lost", "3 frames lost before frame 5"),
        ("lost", "1 frame lost before frame 8"),
    ]
    assert link.frames == FrameCounters(passed=5, lost=4)


def test_what_a_board_says_that_it_lost_is_counted_and_an_event(link, board):
    flags = (0, FrameFlag.LATE, FrameFlag.DEAF, FrameFlag.LATE | FrameFlag.DEAF)
    board.say(*(replace(frame_of(link, n), flags=int(flag)) for n, flag in enumerate(flags)))
    items = drain(link, board)
    assert [e.kind for e in events(items)] == ["late", "deaf", "late", "deaf"]
    assert len(frames(items)) == 4
    assert link.frames == FrameCounters(passed=4, late=2, deaf=2)


def test_a_corrupt_frame_is_a_gap(link, board):
    damaged = bytearray(encode(frame_of(link, 1)))
    damaged[10] ^= 0x10
    board.say(frame_of(link, 0), bytes(damaged), frame_of(link, 2))
    items = drain(link, board)
    assert [e.kind for e in events(items)] == ["lost"]
    assert link.counters.corrupt == 1


def test_the_first_frames_count_too(link, board):
    board.say(frame_of(link, 3))
    assert events(drain(link, board))[0].text == "3 frames lost before frame 3"


def test_the_sequence_wraps(link, board):
    top = 2**32 - 1
    link.session.frames._expected = top
    board.say(frame_of(link, top), frame_of(link, 0), frame_of(link, 1))
    items = drain(link, board)
    assert len(frames(items)) == 3
    assert events(items) == []


def test_frames_behind_the_sequence_are_stale(link, board):
    board.say(frame_of(link, 0), frame_of(link, 1), frame_of(link, 0), frame_of(link, 2))
    items = drain(link, board)
    assert [f.sequence for f in frames(items)] == [0, 1, 2]
    assert link.frames.stale == 1


@pytest.mark.parametrize("kind", ["configuration", "samples"])
def test_foreign_frames_never_pass_and_are_said_once(link, board, kind):
    if kind == "configuration":
        foreign = [
            frame_of(link, n, configuration=link.session.configuration.identity ^ 1)
            for n in range(5)
        ]
    else:
        foreign = [frame_of(link, n, samples=np.zeros(47, np.uint16)) for n in range(5)]
    board.say(frame_of(link, 0), *foreign, frame_of(link, 1), foreign[0])
    items = drain(link, board)
    assert [f.sequence for f in frames(items)] == [0, 1]
    assert [e.kind for e in events(items)] == ["foreign", "foreign"]
    assert "left out" in events(items)[0].text
    assert link.frames.foreign == 6


def test_the_heartbeat_is_kept(link, board, clock):
    board.commands.clear()
    board.answer = lambda _: []
    start = clock.time
    while clock.time < start + 10:
        link.poll(0.05)
    assert set(board.names) == {"Ping"}
    assert 18 <= len(board.names) <= 21


def test_a_board_that_answers_but_does_not_scan_is_set_up_again(link):
    items = poll_until(link, lambda items: [e.kind for e in events(items)][-1:] == ["connected"])
    assert [e.kind for e in events(items)] == ["silent", "reset", "connected"]


def test_frames_that_a_busy_host_has_not_read_yet_are_no_silence(link, board, clock):
    board.commands.clear()
    for number in range(3):
        board.say(frame_of(link, number))
        clock.time += 5.0
        items = link.poll(0.0) + drain(link, board)
        assert events(items) == []
        assert [frame.sequence for frame in frames(items)] == [number]
    assert set(board.names) <= {"Ping"}


def test_silence_is_said_once_and_its_end_too(link, board, clock):
    board.say(frame_of(link, 0))
    items = drain(link, board)
    board.answer = lambda _: []
    start = clock.time
    while clock.time < start + 5:
        items += link.poll(0.1)
    assert [e.kind for e in events(items)] == ["silent"]
    assert "power and cable" in events(items)[0].text
    board.say(frame_of(link, 1))
    items = drain(link, board)
    assert [e.kind for e in events(items)] == ["resumed"]
    assert len(frames(items)) == 1


def test_a_reset_board_is_set_up_again(link, board):
    board.say(frame_of(link, 0), frame_of(link, 1))
    drain(link, board)
    board.commands.clear()
    board.say(HELLO)
    items = poll_until(link, lambda items: any(e.kind == "connected" for e in events(items)))
    assert [e.kind for e in events(items)] == ["reset", "connected"]
    assert board.names == SET_UP
    board.say(frame_of(link, 0))
    assert len(frames(drain(link, board))) == 1


def test_a_fault_is_told_in_words(link, board):
    board.say(Fault(5, FaultCode.CURRENT_TOO_LONG, 3))
    (event,) = events(drain(link, board))
    assert event.kind == "fault"
    assert "switched its current off: a drive was on for longer" in event.text


def test_a_host_that_was_asleep_finds_the_twin_safe_and_goes_on(clock):
    transport = twin_transport(clock)
    link = linked(transport, clock)
    poll_until(link, frames)
    clock.time += 10  # no poll meanwhile: the lid was closed
    transport.device.emit(clock.time)  # the board runs on by itself
    assert not transport.device.driving
    items = poll_until(link, frames)
    assert "reset" in [e.kind for e in events(items)]
    assert frames(items)[-1].sequence == 0
    assert transport.device.driving


def test_unplugging_is_an_error_and_closing_afterwards_is_quiet(link, board):
    board.gone = True
    with pytest.raises(SourceError, match="been disconnected"):
        link.poll(0.1)
    link.close()
    assert board.closed


def test_closing_stops_the_board_and_a_second_time_does_nothing(link, board):
    board.commands.clear()
    link.close()
    link.close()
    assert board.names == ["Stop"]
    assert board.closed


def test_closing_does_not_wait_for_ever(link, board, clock):
    board.answer = lambda _: []
    start = clock.time
    link.close()
    assert clock.time - start == pytest.approx(0.3)


def test_an_error_within_the_block_stops_the_board(clock):
    transport = twin_transport(clock)
    link = linked(transport, clock)
    poll_until(link, frames)
    with pytest.raises(ZeroDivisionError), link:
        raise ZeroDivisionError
    assert not transport.device.driving


def test_poll_waits_no_longer_than_asked(link, board, clock):
    board.say(frame_of(link, 0))
    drain(link, board)
    start = clock.time
    link.poll(0.02)
    assert clock.time - start == pytest.approx(0.02)


def test_no_frame_before_start_is_answered(clock, board):
    link = linked(board, clock)
    board._queue.clear()
    board.say(frame_of(link, 7))
    items = poll_until(link, lambda _: link.running)
    assert frames(items) == []
    assert link.frames.stale == 1


def test_scan_and_board_agree_on_the_number_of_samples():
    assert SCAN.n_samples == 48
    assert BOARD.channels == 8
