"""Drives that come one by one: each at once, full turns as frames, nothing ever mixed."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from board.source.boards import (
    BOARD,
    HELLO,
    NOTHING,
    SCAN,
    SETTINGS,
    ManualClock,
    ScriptedBoard,
    events,
    frame_of,
    frames,
    linked,
    poll_until,
)
from tomoskin.board.source.command_queue import SequenceFilter
from tomoskin.board.source.protocol_session import Assembler
from tomoskin.board.source.settings import Configuration
from tomoskin.board.wire import (
    OLDER,
    Ack,
    Format,
    Result,
    SetFormat,
    type_byte,
)
from tomoskin.core import DriveSamples, Frame
from tomoskin.twin import TwinTransport
from tomoskin.twin.device import TwinDevice

CONFIGURATION = Configuration.of(SCAN, replace(SETTINGS, singly=True))
N = len(SCAN.drives)


def sample(turn, place, drive):
    """Six counts that no other drive of any turn has."""
    return (np.arange(6) + 6 * (drive + N * place) + 6 * N * N * turn).astype(np.uint16)


def drive_of(turn, place, /, **changes):
    head = turn, 1000 * turn + 10 * place, 0.5, CONFIGURATION.identity, 0, 0
    return replace(DriveSamples(*head, 0, place, place, sample(turn, place, place)), **changes)


def frame_at(turn):
    samples = np.concatenate([sample(turn, k, k) for k in range(N)])
    return Frame(turn, 1000 * turn, 0.5, CONFIGURATION.identity, 0, 0, samples)


def same(one, other):
    return all(
        np.array_equal(getattr(one, field.name), getattr(other, field.name))
        for field in fields(Frame)
    )


class Line:
    """An assembler behind a filter that has been opened."""

    def __init__(self):
        self.filter = SequenceFilter(CONFIGURATION)
        self.filter.open()
        self.assembler = Assembler(self.filter, N)

    def take(self, *drives):
        return [item for drive in drives for item in self.assembler.take(drive)]


def drives(items):
    return [item for item in items if isinstance(item, DriveSamples)]


def test_each_drive_passes_at_once_and_the_last_brings_the_frame():
    line = Line()
    for place in range(N - 1):
        (drive,) = line.take(drive_of(0, place))
        assert drive.place == place
    drive, frame = line.take(drive_of(0, N - 1))
    assert same(frame, frame_at(0))
    assert line.filter.counters.passed == 1


TURNS = st.integers(1, 6)


@given(turns=TURNS, data=st.data())
def test_no_loss_doubling_or_swap_ever_mixes_a_frame(turns, data):
    sent = [drive_of(turn, place) for turn in range(turns) for place in range(N)]
    indices = st.integers(0, len(sent) - 1)
    dropped = data.draw(st.sets(indices, max_size=4))
    received = [drive for k, drive in enumerate(sent) if k not in dropped]
    for place in data.draw(st.lists(indices, max_size=3)):
        received.insert(data.draw(indices), sent[place])
    line = Line()
    got = line.take(*received)
    for frame in frames(got):
        assert same(frame, frame_at(frame.sequence))
    numbers = [frame.sequence for frame in frames(got)]
    assert numbers == sorted(set(numbers))
    order = [(drive.sequence, drive.place) for drive in drives(got)]
    assert order == sorted(set(order))
    counters = line.filter.counters
    assert len(drives(got)) + counters.stale + counters.foreign == len(received)


@given(turns=TURNS, data=st.data())
def test_what_is_lost_is_counted_by_turns(turns, data):
    lost = data.draw(st.sets(st.integers(0, turns - 1), max_size=turns - 1))
    last = max(set(range(turns)) - lost)  # behind it nothing says that more are missing
    line = Line()
    places = [(turn, place) for turn in range(last + 1) for place in range(N)]
    got = line.take(*(drive_of(*each) for each in places if each not in {(k, 1) for k in lost}))
    assert {frame.sequence for frame in frames(got)} == set(range(last + 1)) - lost
    assert line.filter.counters.lost == sum(turn < last for turn in lost)


@pytest.mark.parametrize(
    "changes",
    [
        {"configuration": CONFIGURATION.identity ^ 1},
        {"samples": np.zeros(5, np.uint16)},
        {"drive": N},
        {"drive": 3},  # each drive has its place
        {"order": 1},  # nobody has asked for another order
        {"place": 3},
    ],
)
def test_drives_of_another_scan_are_left_out_and_counted(changes):
    line = Line()
    assert events(line.take(*(drive_of(0, k) for k in range(2)))) == []
    got = line.take(drive_of(0, 2, **changes), drive_of(0, 2, **changes))
    assert [event.kind for event in got] == ["foreign"]
    assert line.filter.counters.foreign == 2
    got = line.take(*(drive_of(0, k) for k in range(2, N)))
    assert same(got[-1], frame_at(0))


@pytest.mark.parametrize("changes", [{"flags": 2}, {"drops": 1}])
def test_drives_of_a_turn_that_say_different_things_make_no_frame(changes):
    line = Line()
    got = line.take(*(drive_of(0, k, **(changes if k == 3 else {})) for k in range(N)))
    assert frames(got) == []
    assert len(drives(got)) == N - 1
    assert line.filter.counters.foreign == 1


def test_nothing_passes_before_start_is_answered():
    line = Line()
    line.filter.close()
    assert line.take(drive_of(0, 0)) == []
    assert line.filter.counters.stale == 1


class Moving:
    """A converter whose counts tell the channel, the direction and the time."""

    def sample(self, table, time):
        ticks = np.rint(1e5 * (time + table.time) + 0.25).astype(int) % 200
        return (ticks + 7 * table.channel + 20 * table.sink).astype(np.uint16)


def singly(transport, clock, **changes):
    return linked(transport, clock, singly=True, **changes)


@pytest.mark.parametrize("changes", [{}, {"oversampling": 1}, {"chop_frequency": 400}])
def test_frames_of_drives_are_the_frames_of_whole_scans(changes):
    received = []
    for asks in (False, True):
        clock = ManualClock()
        transport = TwinTransport(NOTHING, TwinDevice(Moving(), BOARD, clock.now()), clock)
        with linked(transport, clock, singly=asks, **changes) as link:
            items = poll_until(link, lambda items: len(frames(items)) >= 12)
        received.append(items)
        assert bool(drives(items)) == asks
        assert [event.kind for event in events(items)] == ["connected"]
        assert link.frames.passed == len(frames(items))
        assert link.frames.lost == link.frames.stale == link.frames.foreign == 0
    whole, made = map(frames, received)
    for one, other in zip(whole[:12], made[:12], strict=True):
        assert same(replace(one, host_time=0.0), replace(other, host_time=0.0))
        assert one.samples.dtype == other.samples.dtype


class Asked(ScriptedBoard):
    """A board that agrees to everything, and remembers it."""


class OldBoard(ScriptedBoard):
    """A board of protocol 1.2."""

    def answer(self, command):
        if type(command).__name__ == "GetInfo":
            return [replace(BOARD.info(command.request), minor=2, schema_hash=OLDER[1, 2])]
        return super().answer(command)


class Refusing(ScriptedBoard):
    """A board that says that it can, and then refuses."""

    def answer(self, command):
        if isinstance(command, SetFormat) and command.format is Format.DRIVES:
            return [Ack(command.request, type_byte(SetFormat), Result.BAD_VALUE, 2)]
        return super().answer(command)


def test_an_older_board_sends_whole_scans_and_that_is_said_once():
    clock = ManualClock()
    board = OldBoard(clock, hello=replace(HELLO, minor=2, schema_hash=OLDER[1, 2]))
    with singly(board, clock) as link:
        link.connect()
        board.say(frame_of(link, 0), frame_of(link, 1))
        got = poll_until(link, lambda items: len(frames(items)) == 2)
    assert [event.kind for event in events(got)] == ["whole-scans"]
    assert [c.format for c in board.commands if isinstance(c, SetFormat)] == [Format.SIXTEEN]


def test_a_board_that_refuses_is_set_up_again_for_whole_scans():
    clock = ManualClock()
    board = Refusing(clock)
    with singly(board, clock) as link:
        got = poll_until(link, lambda _: link.running)
        board.say(frame_of(link, 0))
        got += poll_until(link, frames)
    assert [event.kind for event in events(got)] == ["whole-scans", "connected"]
    formats = [c.format for c in board.commands if isinstance(c, SetFormat)]
    assert formats == [Format.DRIVES, Format.SIXTEEN]


def test_a_board_that_never_sends_a_drive_is_set_up_again_for_whole_scans():
    clock = ManualClock()
    board = Asked(clock)
    with singly(board, clock) as link:
        link.connect()
        got = poll_until(link, lambda items: len(events(items)) == 2)
    assert [event.kind for event in events(got)] == ["whole-scans", "connected"]
    formats = [c.format for c in board.commands if isinstance(c, SetFormat)]
    assert formats == [Format.DRIVES, Format.SIXTEEN]


def test_a_board_that_stops_sending_drives_is_silent_as_any_other():
    clock = ManualClock()
    board = Asked(clock)
    with singly(board, clock) as link:
        link.connect()
        board.say(drive_of(0, 0))
        got = poll_until(link, events)
    assert [event.kind for event in events(got)] == ["silent"]


def test_drives_of_a_recording_that_nobody_has_asked_for_make_frames_only():
    clock = ManualClock()
    board = Asked(clock)
    with linked(board, clock) as link:
        link.connect()
        board.say(*(drive_of(0, k) for k in range(N)))
        (frame,) = poll_until(link, lambda items: items)
    assert same(replace(frame, host_time=0.5), frame_at(0))


def test_a_line_that_never_carries_a_full_turn_is_asked_for_whole_scans():
    clock = ManualClock()
    board = Asked(clock)
    with singly(board, clock) as link:
        link.connect()
        for turn in range(30):
            board.say(*(drive_of(turn, k) for k in range(N) if k != 4))
        got = poll_until(link, lambda items: len(events(items)) == 22)
        assert link.frames.lost == 20
    assert [event.kind for event in events(got)[-2:]] == ["whole-scans", "connected"]
    assert {event.kind for event in events(got)[:-2]} == {"lost"}
    assert frames(got) == []


def test_a_seek_begins_anew():
    line = Line()
    line.take(*(drive_of(7, k) for k in range(3)))
    line.filter.expect_any()
    line.assembler.forget()
    got = line.take(*(drive_of(2, k) for k in range(N)))
    assert same(got[-1], frame_at(2))
    assert line.filter.counters.lost == 7  # those before the first
