"""Boards for tests: one that follows a script, and the twin's firmware before a fake converter."""

import threading
from collections import deque
from dataclasses import astuple, replace
from types import SimpleNamespace

import numpy as np

from tomoskin.board.source import Link, ScanSettings
from tomoskin.board.wire import (
    SCHEMA,
    Ack,
    Deframer,
    GetBoard,
    GetInfo,
    GetMode,
    GetPattern,
    GetScan,
    HeldMode,
    HeldPattern,
    HeldScan,
    Hello,
    Result,
    SetFormat,
    SetMode,
    SetPattern,
    SetScan,
    decode_payload,
    encode,
    type_byte,
)
from tomoskin.core import Event, Frame, SourceError
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.twin import Board, TwinTransport
from tomoskin.twin.device import TwinDevice

SCAN = Scan.of(Pattern.adjacent(8))
SETTINGS = ScanSettings(oversampling=4, settling=200e-6, current_limit=0.1, adc_bits=10)
BOARD = Board(channels=8, adc_bits=10, current=0.1, tick_rate=250e3)
PATTERN_FIELDS = ("configuration", "first", "drives")
SET_UP = [
    *("GetInfo", "Stop", "GetBoard", "SetScan", "SetPattern", "SetFormat"),
    *("GetScan", "GetPattern", "Start"),
]
HELLO = Hello(SCHEMA.major, SCHEMA.minor, SCHEMA.hash)


class ManualClock:
    """Time that passes only when somebody waits."""

    def __init__(self, now=1000.0):
        self.time = now

    def now(self):
        return self.time

    def wait(self, condition, seconds):
        assert isinstance(condition, threading.Condition)
        assert seconds > 0
        self.time += seconds


class ScriptedBoard:
    """A transport whose answers a test can bend.

    ``answer(command)`` gives the messages for a command; ``say`` queues others.
    """

    name = "script"

    def __init__(self, clock, hello=HELLO):
        self.clock = clock
        self.commands = []
        self.closed = False
        self.gone = False
        self._deframer = Deframer(SCHEMA.to_device_bytes)
        self._queue = deque()
        if hello:
            self.say(hello)

    def answer(self, command):
        if isinstance(command, GetInfo):
            return [BOARD.info(command.request)]
        if isinstance(command, GetBoard):
            return [replace(BOARD.limits, request=command.request)]
        if isinstance(command, GetScan | GetPattern | GetMode):
            return [self.held(command)]
        return [Ack(command.request, type_byte(type(command)), Result.OK, 0)]

    def held(self, command):
        """What the commands so far have set."""
        if isinstance(command, GetScan):
            scan, fmt = self._last(SetScan), self._last(SetFormat)
            return HeldScan(command.request, *astuple(scan)[1:], fmt.format)
        if isinstance(command, GetMode):
            return HeldMode(command.request, *astuple(self._last(SetMode))[1:])
        pattern = self._last(SetPattern, first=command.first)
        return HeldPattern(command.request, *(getattr(pattern, n) for n in PATTERN_FIELDS))

    def _last(self, kind, **wanted):
        """The newest command of a kind with these values."""
        return [
            c for c in self.commands
            if isinstance(c, kind) and all(getattr(c, n) == v for n, v in wanted.items())
        ][-1]  # fmt: skip

    def say(self, *messages):
        self._queue.extend(m if isinstance(m, bytes) else encode(m) for m in messages)

    def read(self, timeout):
        if self.gone:
            raise SourceError("the board has been disconnected", where=self.name)
        if self._queue:
            return self._queue.popleft()
        self.clock.time += timeout
        return b""

    def write(self, data):
        if self.gone:
            raise SourceError("the board has been disconnected", where=self.name)
        for payload in self._deframer.feed(data):
            command = decode_payload(payload, 0.0)
            self.commands.append(command)
            self.say(*self.answer(command))

    def close(self):
        self.closed = True

    @property
    def names(self):
        return [type(command).__name__ for command in self.commands]


class Counting:
    """A converter whose counts are known: the k-th scan reads k, k + 1, …"""

    def __init__(self):
        self.scans = 0

    def sample(self, table, _time):
        counts = np.arange(len(table.channel)) + self.scans
        self.scans += 1
        return counts.astype(np.uint16)


NOTHING = SimpleNamespace(sheet=None, settings=SimpleNamespace(noise=None))
"""Electronics of a device that has a converter of its own, which nothing asks for anything."""


def twin_transport(clock, pace=1.0, board=BOARD):
    return TwinTransport(NOTHING, TwinDevice(Counting(), board, clock.now(), pace), clock)


def linked(transport, clock, **changes):
    return Link(transport, SCAN, replace(SETTINGS, **changes), clock=clock.now)


def frames(items):
    return [item for item in items if isinstance(item, Frame)]


def events(items):
    return [item for item in items if isinstance(item, Event)]


def poll_until(link, enough, timeout=0.05, most=2000):
    """Everything polled until ``enough(items)``."""
    items = []
    for _ in range(most):
        items += link.poll(timeout)
        if enough(items):
            return items
    raise AssertionError(f"not within {most} polls: {events(items)}")


def frame_of(link, sequence, samples=None, configuration=None):
    counts = np.zeros(SCAN.n_samples, dtype=np.uint16) if samples is None else samples
    return Frame(
        sequence,
        0,
        0.0,
        link.session.configuration.identity if configuration is None else configuration,
        0,
        0,
        counts,
    )
