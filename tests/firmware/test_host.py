"""The same firmware as a process: the whole conversation through a serial port."""

import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from firmware.boards import PATIENCE, SCAN, SETTINGS, Talk, running, star_counts
from tomoskin.board.source import Link, serial as port
from tomoskin.board.wire import (
    Ack,
    BoardLimits,
    Decoder,
    Drive,
    DriveMode,
    Fault,
    FaultCode,
    Format,
    GetBoard,
    GetInfo,
    GetMode,
    GetPattern,
    GetScan,
    HeldMode,
    HeldPattern,
    HeldScan,
    Hello,
    Info,
    Ping,
    Result,
    SafeOff,
    SetBaud,
    SetFormat,
    SetHeartbeat,
    SetMode,
    SetPattern,
    SetScan,
    Start,
    Stop,
    encode,
)
from tomoskin.core import Event, Frame, SourceError
from tomoskin.twin import Board
from tomoskin.twin.device import TwinDevice

LIMITS = BoardLimits(0, b"Linux process".ljust(24, b"\0"), 10, 5000, 1000, 1000, 0, 813)
TWIN = Board(16, 10, 0.1, 250e3, 128, 448, unique_id=b"host\0\0\0\0", limits=LIMITS)
"""The twin's board with this firmware's limits."""


def frames_of(link, count):
    """``count`` frames and the events beside them."""
    frames, events, end = [], [], time.monotonic() + PATIENCE
    while len(frames) < count:
        assert time.monotonic() < end, events
        for item in link.poll(0.05):
            (frames if isinstance(item, Frame) else events).append(item)
    return frames, events


def test_handshake_scan_and_values(board):
    transport = port.open_serial(board.path, None)
    with Link(transport, SCAN, SETTINGS) as link:
        frames, events = frames_of(link, 50)
        assert link.session.info.unique_id == b"host\0\0\0\0"
        assert link.session.info.channels == 16
        assert link.counters.corrupt == 0
        # a host that sleeps for long leaves no room on the pty: the board says what it drops
        assert link.frames.lost == frames[-1].drops
    assert events[0].kind == "connected"
    assert [frame.sequence for frame in frames][:3] == [0, 1, 2]
    assert [frame.flags for frame in frames[:2]] == [1, 0]
    for frame in frames:
        assert frame.samples.tolist() == star_counts(4)
    # 8 drives of 202 us and 6 x 4 conversions of 52 us: 2900 ticks of 4 us
    periods = np.diff([frame.ticks for frame in frames])
    assert np.median(periods) == pytest.approx(2900, rel=0.02)


def test_stop_ends_the_scan(board):
    transport = port.open_serial(board.path, None)
    link = Link(transport, SCAN, SETTINGS)
    frames_of(link, 3)
    link.close()
    talk = Talk(port.open_serial(board.path, None))
    talk.ask(Ping(77), Ack)
    silent_until = time.monotonic() + 0.3
    while time.monotonic() < silent_until:
        assert talk.transport.read(0.05) == b""
    talk.transport.close()


def test_a_dead_time_that_is_not_waited_for_is_no_drive_that_is_on_for_too_long(board):
    """The clock must not go back by it after an interrupt: the guard took that for hours."""
    settings = replace(SETTINGS, settling=36e-6, oversampling=1, dead_time=50e-6)
    with Link(port.SerialTransport(board.path), SCAN, settings) as link:
        _, events = frames_of(link, 2000)
    # Frames are lost where the process that reads has to wait.
    assert {event.kind for event in events} <= {"connected", "lost"}


def test_host_silence_switches_off(board):
    talk = Talk(port.open_serial(board.path, None))
    fault = fallen_silent(talk)
    while fault.code is FaultCode.CURRENT_TOO_LONG:  # its own process had to wait: it is right
        fault = fallen_silent(talk)
    assert fault.code is FaultCode.HOST_SILENT
    assert talk.next(Hello)
    # A repeated id after silence is a new command: here one that finds an idle board.
    assert talk.ask(SetScan(10, 5, 1, 0, 2, 1, 64, 100_000), Ack).result is Result.OK
    talk.transport.close()


def fallen_silent(talk):
    """The first fault of a board that scans and hears no more."""
    set_up(talk)
    # in one write: between two, a busy machine may be silent for longer than that
    talk.transport.write(encode(SetHeartbeat(9, 100)) + encode(Start(10, 5)))
    assert [talk.next(Ack).result for _ in range(2)] == [Result.OK] * 2
    assert talk.next(Frame).sequence == 0
    return talk.next(Fault)


def set_up(talk):
    talk.next(Hello)
    assert talk.ask(SetScan(1, 5, 1, 200, 2, 1, 64, 100_000), Ack).result is Result.OK
    assert talk.ask(SetPattern(2, 5, 0, (Drive(1, 0, 0b100),)), Ack).result is Result.OK


def test_a_repeated_command_is_not_run_twice(board):
    talk = Talk(port.open_serial(board.path, None))
    set_up(talk)
    assert talk.ask(Start(3, 5), Ack) == talk.ask(Start(3, 5), Ack)
    assert talk.ask(Start(4, 5), Ack).result is Result.BUSY
    assert talk.ask(SafeOff(5), Ack).result is Result.OK
    assert talk.ask(Start(6, 5), Ack).result is Result.WRONG_CONFIGURATION
    talk.transport.close()


def test_a_baud_rate_that_nobody_confirms_is_given_up(board):
    talk = Talk(port.open_serial(board.path, None))
    talk.next(Hello)
    assert talk.ask(SetBaud(1, 123), Ack).result is Result.BAD_VALUE
    assert talk.ask(SetBaud(2, 500_000), Ack).result is Result.OK
    assert talk.ask(Ping(3), Ack).result is Result.OK
    talk.transport.close()


def test_dirt_is_dropped(board):
    talk = Talk(port.open_serial(board.path, None))
    talk.next(Hello)
    good = encode(Ping(1))
    for dirt in (b"\0\0\0", b"x" * 500 + b"\0", good[:-2] + b"\7\0", b"\5abc\0", b"\xff\0"):
        talk.transport.write(dirt)
    assert talk.ask(Ping(2), Ack).request == 2
    talk.transport.close()


def test_unplugged_and_plugged_in_again(board_program, tmp_path):
    where = tmp_path / "port"
    with running(board_program, where) as first:
        link = Link(port.open_serial(first.path, None), SCAN, SETTINGS)
        frames_of(link, 3)
        first.kill()
        with pytest.raises(SourceError, match="been disconnected"):
            frames_of(link, 10_000)
        link.close()
    with (
        running(board_program, where) as second,
        Link(port.open_serial(second.path, None), SCAN, SETTINGS) as link,
    ):
        frames, _ = frames_of(link, 3)
        assert frames[0].sequence == 0


def test_a_killed_host_leaves_a_board_that_starts_anew(board):
    first = port.open_serial(board.path, None)
    frames_of(Link(first, SCAN, SETTINGS), 3)
    first.close()  # no STOP
    with Link(port.open_serial(board.path, None), SCAN, SETTINGS) as link:
        frames, events = frames_of(link, 3)
        assert [frame.sequence for frame in frames[:3]] == [0, 1, 2]
        assert not [e for e in events if isinstance(e, Event) and e.kind == "foreign"]


def test_a_board_set_above_the_skin_is_refused(board_program, tmp_path):
    with (
        running(board_program, tmp_path / "port", "-c", "150000") as board,
        Link(port.open_serial(board.path, None), SCAN, SETTINGS) as link,
        pytest.raises(SourceError, match="150 mA"),
    ):
        link.connect()


def test_too_many_channels_for_the_board_are_refused(board):
    talk = Talk(port.open_serial(board.path, None))
    set_up(talk)
    said = talk.ask(SetPattern(3, 5, 0, (Drive(16, 0, 1),)), Ack)
    assert said.result is Result.NO_SUCH_CHANNEL
    said = talk.ask(SetPattern(4, 5, 0, (Drive(1, 0, 1 << 16),)), Ack)
    assert said.result is Result.NO_SUCH_CHANNEL
    talk.transport.close()


# Twin and firmware answer alike, byte by byte.

u8, small, u16, u32 = (st.integers(0, 2**bits - 1) for bits in (8, 5, 16, 32))
identities = st.sampled_from([0, 5, 6])
drives = st.lists(
    st.builds(Drive, st.integers(0, 17), st.integers(0, 17), st.sampled_from([0, 1, 255, 1 << 16])),
    max_size=4,
).map(tuple)
commands = st.one_of(
    st.builds(Ping, u8),
    st.builds(GetInfo, u8),
    st.builds(Stop, u8),
    st.builds(SafeOff, u8),
    st.builds(
        SetScan, u8, identities, st.sampled_from([0, 1, 2, 3, 128, 129]),
        st.sampled_from([0, 100, 100_000, 100_001]), u16, st.sampled_from([0, 1, 64, 65]),
        st.sampled_from([16, 64, 128, 63]), st.sampled_from([99_999, 100_000, 2**32 - 1]),
    ),
    st.builds(SetPattern, u8, identities, st.integers(0, 3), drives),
    st.builds(SetHeartbeat, u8, st.sampled_from([99, 10_001])),
    st.builds(Start, u8, st.sampled_from([0, 7])),
    st.builds(SetFormat, u8, identities, st.sampled_from(list(Format))),
    st.builds(GetScan, u8),
    st.builds(GetPattern, u8, st.integers(0, 3)),
    st.builds(GetBoard, u8),
    st.builds(
        SetMode, u8, identities, st.sampled_from(list(DriveMode)),
        st.sampled_from([0, 9, 10, 300, 5000, 5001]), st.sampled_from([0, 1, 3, 32, 33]),
    ),
    st.builds(GetMode, u8),
)  # fmt: skip


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(said=st.lists(commands, min_size=1, max_size=12))
def test_twin_and_firmware_answer_alike(board, said):
    twin = TwinDevice(None, TWIN, 0.0)
    transport = port.open_serial(board.path, None)
    talk = Talk(transport)
    talk.ask(SafeOff(255), Ack)
    said = [replace(c, request=n % 254 + 1) if n % 3 else c for n, c in enumerate(said)]
    twin.receive(encode(SafeOff(255)), 0.0)
    twin.emit(0.0)
    for command in said:
        twin.receive(encode(command), 0.0)
        wanted = Decoder().feed(twin.emit(0.0), 0.0)
        assert [
            talk.ask(command, (Ack, Info, HeldScan, HeldPattern, BoardLimits, HeldMode))
        ] == wanted
    transport.close()
