"""The twin's firmware, command by command."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tomoskin.board.wire import (
    SCHEMA,
    Ack,
    Decoder,
    Drive,
    Fault,
    FaultCode,
    GetInfo,
    Hello,
    Info,
    Ping,
    Result,
    SafeOff,
    SetBaud,
    SetHeartbeat,
    SetPattern,
    SetScan,
    Start,
    Stop,
    encode,
)
from tomoskin.board.wire.framing import enclose
from tomoskin.core import Frame
from tomoskin.twin import Board
from tomoskin.twin.device import TwinDevice

BOARD = Board(channels=8, adc_bits=10, current=0.1, tick_rate=250e3, max_drives=4, max_samples=20)
SCAN = SetScan(1, 7, 2, 1000, 0, 1, 64, 100_000)
PATTERN = SetPattern(2, 7, 0, (Drive(1, 0, 0b11111100), Drive(2, 1, 0b11111001)))
PERIOD = 2 * 1e-3 + 12 * 52e-6


class Known:
    """Counts that a test has put in."""

    def __init__(self):
        self.given = []

    def sample(self, table, _time):
        counts = np.random.default_rng(len(self.given)).integers(0, 1024, len(table.channel))
        self.given.append(counts.astype(np.uint16))
        return self.given[-1]


class Bench:
    def __init__(self, pace=1.0):
        self.now = 50.0
        self.analogue = Known()
        self.device = TwinDevice(self.analogue, BOARD, self.now, pace)
        self.decoder = Decoder()

    def send(self, *commands):
        self.device.receive(b"".join(map(encode, commands)), self.now)
        return self.said()

    def said(self):
        return self.decoder.feed(self.device.emit(self.now), self.now)

    def until(self, end):
        heard = []
        while self.device.due <= end:
            self.now = self.device.due
            heard += self.said()
        self.now = end
        return heard

    def result(self, command):
        acks = [m for m in self.send(command) if isinstance(m, Ack)]
        assert len(acks) == 1
        assert acks[0].request == command.request
        return acks[0].result, acks[0].detail

    def start(self):
        for command in (SCAN, PATTERN, Start(3, 7)):
            assert self.result(command) == (Result.OK, 0)


@pytest.fixture
def bench():
    return Bench()


@pytest.fixture
def idle(bench):
    bench.send(GetInfo(200))
    return bench


def test_hello_every_half_second_until_spoken_to(bench):
    assert bench.until(52.2) == [Hello(SCHEMA.major, SCHEMA.minor, SCHEMA.hash)] * 5
    assert [type(m) for m in bench.send(Ping(9))] == [Ack]
    assert bench.until(53.9) == []


def test_info(bench):
    (info,) = bench.send(GetInfo(5))
    assert isinstance(info, Info)
    assert (info.request, info.channels, info.adc_bits) == (5, 8, 10)
    assert (info.current, info.tick_rate) == (100_000, 250_000)
    assert info.schema_hash == SCHEMA.hash


def test_frames_hold_the_counts_put_in_at_the_rate_of_the_scan(idle):
    idle.start()
    frames = [m for m in idle.until(idle.now + 20.5 * PERIOD) if isinstance(m, Frame)]
    assert [f.sequence for f in frames] == list(range(20))
    assert [f.flags for f in frames] == [1] + [0] * 19
    for frame, counts in zip(frames, idle.analogue.given, strict=True):
        assert np.array_equal(frame.samples, counts)
        assert frame.configuration == 7
    ticks = np.diff([f.ticks for f in frames])
    assert ticks == pytest.approx(np.full(19, PERIOD * 250e3), abs=1)


def test_a_slow_computer_delays_the_scan_and_loses_nothing(idle):
    idle.start()
    idle.now += 10 * PERIOD
    first = idle.said()[0]
    second = idle.said()
    assert second == [] or second[0].sequence == 1
    later = [m for m in idle.until(idle.now + 3.5 * PERIOD) if isinstance(m, Frame)]
    sequences = [first.sequence, *(f.sequence for f in [*second, *later])]
    assert sequences == list(range(len(sequences)))
    assert len(sequences) <= 6


def test_without_pace_there_is_always_a_frame():
    bench = Bench(pace=0.0)
    bench.send(GetInfo(200))
    bench.start()
    frames = [bench.said()[0] for _ in range(50)]
    assert frames[-1].sequence - frames[0].sequence == 49
    step = (frames[-1].ticks - frames[0].ticks) / 49
    assert step == pytest.approx(PERIOD * 250e3, rel=1e-2)


@pytest.mark.parametrize("command", [Stop(9), SafeOff(9)])
def test_stop_switches_the_current_off(idle, command):
    idle.start()
    assert idle.device.driving
    assert idle.result(command) == (Result.OK, 0)
    assert not idle.device.driving
    assert idle.until(idle.now + 1) == []


def test_only_safe_off_forgets_the_configuration(idle):
    idle.start()
    idle.send(Stop(9))
    assert idle.result(Start(10, 7)) == (Result.OK, 0)
    idle.send(SafeOff(11))
    assert idle.result(Start(12, 7)) == (Result.WRONG_CONFIGURATION, 0)
    assert not idle.device.driving


def test_host_silence_switches_the_current_off(idle):
    idle.start()
    heard = idle.until(idle.now + 2.1)
    fault, hello = [m for m in heard if not isinstance(m, Frame)]
    assert isinstance(fault, Fault)
    assert fault.code is FaultCode.HOST_SILENT
    assert isinstance(hello, Hello)
    assert not idle.device.driving
    assert len(idle.until(idle.now + 1.0)) == 2


def test_pings_keep_it_going_and_the_heartbeat_can_be_set(idle):
    idle.start()
    for request in range(10, 20):
        idle.until(idle.now + 1.5)
        idle.send(Ping(request))
    assert idle.device.driving
    assert idle.result(SetHeartbeat(30, 99)) == (Result.BAD_VALUE, 1)
    assert idle.result(SetHeartbeat(31, 300)) == (Result.OK, 0)
    idle.until(idle.now + 0.4)
    assert not idle.device.driving


def test_a_repeated_command_is_answered_again_and_not_run_twice(idle):
    idle.start()
    idle.until(idle.now + 5.5 * PERIOD)
    assert idle.result(Start(3, 7)) == (Result.OK, 0)
    (frame, *_) = [m for m in idle.until(idle.now + PERIOD) if isinstance(m, Frame)]
    assert frame.sequence == 5
    assert idle.result(Start(4, 7)) == (Result.BUSY, 0)


def test_the_same_id_with_other_bytes_is_another_command(idle):
    assert idle.result(replace(SCAN, request=1)) == (Result.OK, 0)
    assert idle.result(replace(SCAN, request=1, oversampling=0)) == (Result.BAD_VALUE, 5)


@pytest.mark.parametrize("command", [SCAN, PATTERN, Start(9, 7), SetBaud(9, 500_000)])
def test_busy_while_scanning(idle, command):
    idle.start()
    idle.send(Ping(99))
    assert idle.result(command) == (Result.BUSY, 0)
    assert idle.device.driving


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({"configuration": 0}, (Result.BAD_VALUE, 1)),
        ({"n_drives": 0}, (Result.BAD_VALUE, 2)),
        ({"n_drives": 5}, (Result.TOO_MANY_DRIVES, 4)),
        ({"settling": 100_001}, (Result.BAD_VALUE, 3)),
        ({"oversampling": 65}, (Result.BAD_VALUE, 5)),
        ({"prescaler": 63}, (Result.BAD_VALUE, 6)),
        ({"current_limit": 99_999}, (Result.CURRENT_TOO_HIGH, 0)),
    ],
)
def test_scans_that_are_refused(idle, change, verdict):
    assert idle.result(replace(SCAN, **change)) == verdict
    assert idle.result(Start(9, 7)) == (Result.WRONG_CONFIGURATION, 0)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({"configuration": 8}, (Result.WRONG_CONFIGURATION, 0)),
        ({"drives": ()}, (Result.BAD_VALUE, 2)),
        ({"first": 1}, (Result.BAD_VALUE, 2)),
        ({"drives": (Drive(1, 0, 4), Drive(3, 3, 4))}, (Result.SAME_ELECTRODE, 1)),
        ({"drives": (Drive(8, 0, 4),)}, (Result.NO_SUCH_CHANNEL, 0)),
        ({"drives": (Drive(1, 0, 4), Drive(1, 0, 256))}, (Result.NO_SUCH_CHANNEL, 1)),
    ],
)
def test_patterns_that_are_refused(idle, change, verdict):
    idle.send(SCAN)
    assert idle.result(replace(PATTERN, **change)) == verdict
    assert idle.result(Start(9, 7)) == (Result.INCOMPLETE, 0)
    assert not idle.device.driving


def test_a_scan_with_a_drive_missing_or_too_many_samples_does_not_start(idle):
    idle.send(replace(SCAN, n_drives=4))
    idle.send(PATTERN)
    assert idle.result(Start(9, 7)) == (Result.INCOMPLETE, 2)
    idle.send(SetPattern(10, 7, 2, (Drive(3, 2, 0xFF), Drive(4, 3, 0xFF))))
    assert idle.result(Start(11, 7)) == (Result.TOO_MANY_SAMPLES, 20)
    assert not idle.device.driving


def test_what_it_does_not_know_is_refused_and_keeps_nothing_alive(idle):
    def answer(payload):
        idle.device.receive(enclose(payload), idle.now)
        return [(m.command, m.request, m.result) for m in idle.said() if isinstance(m, Ack)]

    assert answer(b"\xfe\x2a\x00") == [(0xFE, 0x2A, Result.UNKNOWN_COMMAND)]
    assert answer(b"\x82\x2a\x00") == [(0x82, 0x2A, Result.BAD_LENGTH)]
    assert answer(b"\x82") == []


@settings(deadline=None)
@given(st.lists(st.binary(max_size=100), max_size=6))
def test_arbitrary_bytes_never_raise_and_never_switch_the_current_on(chunks):
    bench = Bench()
    for chunk in chunks:
        bench.device.receive(chunk, bench.now)
        bench.device.emit(bench.now)
    assert not bench.device.driving


@settings(deadline=None)
@given(st.lists(st.binary(min_size=2, max_size=30), max_size=6))
def test_arbitrary_payloads_never_raise(payloads):
    bench = Bench()
    for payload in payloads:
        bench.device.receive(b"\0" + enclose(payload), bench.now)
        bench.said()
    assert not bench.device.driving
