"""The alternating drive on both boards' real images: values, balance, limits, safety, rate."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from firmware.boards import Talk
from firmware.emulator.test_mutants import mutated as mutated_elf
from firmware.emulator.test_pico import mutated as mutated_image
from firmware.emulator.watch import CLOCK, Watch
from tomoskin.board.source import Link, ScanSettings, SerialTransport, Timing
from tomoskin.board.wire import (
    Ack,
    BoardLimits,
    Drive,
    DriveMode,
    Fault,
    GetBoard,
    Hello,
    Ping,
    Result,
    SafeOff,
    SetHeartbeat,
    SetMode,
    SetPattern,
    SetScan,
    Start,
    Stop,
    encode,
)
from tomoskin.core import Frame, SourceError
from tomoskin.model.pattern import Pattern, Scan
from tomoskin_emulator.board_process import (
    BoardProcess,
    BoardPrograms,
    Front,
    OwnVoltages,
    SkinMemory,
)
from tomoskin_emulator.program import PicoPrograms

CURRENT, N = 0.1, 8
SCAN = Scan.of(Pattern.skip(N, 2))
"""A Pico refuses neighbours, one of which it reads against in one of the directions."""
POTENTIALS = np.array([3, -7, 0, 12, -20, 5, 9, -4]) * 1e-3
"""V that each electrode has by itself."""
OFFSET = 0.4
"""V of the amplifier."""
LATE = 0.08
"""Part by which a period may be longer than it should: dead time, latch and interrupts."""
PATIENCE = 60.0
AGAIN = 3.0


@dataclass(frozen=True)
class Kind:
    """What a board is called, its converter, and an alternation that it can do."""

    text: str
    bits: int
    reference: float
    settings: ScanSettings
    periods: int
    lateness: float
    """s that an interrupt may wait for others."""

    def codes(self, volts: np.ndarray) -> np.ndarray:
        levels = 2**self.bits
        return np.floor((volts + OFFSET) * levels / self.reference).clip(0, levels - 1)


KINDS = {
    "pico": Kind(
        "Raspberry Pi Pico",
        12,
        3.3,
        ScanSettings(4, 36e-6, CURRENT, 12, chop_frequency=5000),
        2,
        0.0,
    ),
    "mega": Kind(
        "Arduino Mega 2560",
        10,
        5.0,
        ScanSettings(4, 200e-6, CURRENT, 10, chop_frequency=700),
        2,
        50e-6,
    ),
}


@dataclass(frozen=True)
class Seen:
    """What an emulator saw, s.

    ``net`` of pairs, by the lower channel: how much longer from the other one to it than back.
    """

    connected: bool
    longest_on: float
    shortest_off: float
    net: np.ndarray


@dataclass(frozen=True)
class Powered:
    """A board that runs, of a kind."""

    kind: Kind
    process: BoardProcess
    watch: Path

    def look(self) -> Seen:
        if self.kind.bits == 12:
            seen = json.loads(self.watch.read_text(encoding="utf-8"))
            off = (seen["shortestOff"] or np.inf) * 1e-9
            net = np.array(seen["net"][:N]) * 1e-9
            return Seen(seen["connected"], seen["longestOn"] * 1e-9, off, net)
        found = Watch.read(self.watch)
        return Seen(
            found.connected, found.on / CLOCK, found.shortest_off / CLOCK, found.net[:N] / CLOCK
        )

    def until(self, holds: Callable[[Seen], bool]) -> Seen:
        end = time.monotonic() + PATIENCE
        while not (self.watch.exists() and holds(self.look())):
            assert time.monotonic() < end
            time.sleep(0.02)
        return self.look()


@contextmanager
def powered(programs: BoardPrograms, kind: Kind, folder: Path) -> Iterator[Powered]:
    """A board on a star of 1 + e ohm; what its emulator complains of fails the test."""
    front = Front(CURRENT, 1e9, 1.0, OFFSET, kind.reference, 2.0**kind.bits, 0.0)
    arms = np.diag(np.arange(1.0, N + 1))
    memory = SkinMemory(folder / "skin", front, arms, own=OwnVoltages(POTENTIALS))
    board = BoardProcess(programs, memory.path, CURRENT, "-w", str(folder / "watch"), "-f")
    try:
        yield Powered(kind, board, folder / "watch")
    finally:
        board.close()
        memory.close()
    assert board.last_words == ""


@pytest.fixture(params=KINDS)
def board(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Powered]:
    programs = request.getfixturevalue("pico" if request.param == "pico" else "programs")
    with powered(programs, KINDS[request.param], tmp_path) as one:
        yield one


def analytic(kind: Kind, half: int) -> tuple[np.ndarray, np.ndarray]:
    """Summed codes in both directions: V = I (1 + sink), source I (sum), and potentials."""
    source, sink = SCAN.drives[SCAN.sample_drive].T
    e = SCAN.sample_electrode

    def read(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        volts = CURRENT * (1 + b + (e == a) * (1 + a)) + POTENTIALS[e] - POTENTIALS[b]
        return half * kind.codes(volts)

    return read(source, sink), read(sink, source)


def examine(board: Powered) -> None:
    """Scan, stop, and look at values, rate, balance and switches; AssertionError says what."""
    kind = board.kind
    link = Link(SerialTransport(board.process.port), SCAN, kind.settings, timing=Timing(ping=0.02))
    with link:
        frames: list[Frame] = []
        end = time.monotonic() + PATIENCE
        while len(frames) < 12:
            assert time.monotonic() < end
            frames += [item for item in link.poll(0.05) if isinstance(item, Frame)]
        info = link.session.info
        assert info is not None
        assert link.session.board is not None
        assert link.session.board.text == kind.text
    ahead, back = analytic(kind, kind.settings.oversampling // 2)
    for number, frame in enumerate(frames[:12]):
        assert frame.sequence == number
        assert (frame.samples.astype(int) - 0x8000).tolist() == (ahead - back).astype(int).tolist()
        assert frame.sums is not None
        assert frame.sums.tolist() == (ahead + back).astype(int).tolist()
    frequency = kind.settings.chop_frequency
    period = np.diff([frame.ticks for frame in frames]).mean() / info.tick_rate
    assert 1 <= period * frequency / (kind.periods * N) < 1 + LATE
    seen = board.until(lambda seen: not seen.connected)
    assert seen.longest_on <= 0.5 / frequency + kind.lateness
    assert seen.shortest_off >= kind.settings.dead_time
    net = np.sort(np.abs(seen.net))
    assert net[-1] <= 0.5 / frequency + kind.lateness  # the drive that STOP ended
    assert net[:-1].max() < 100e-6


def test_values_rate_and_balance(board: Powered) -> None:
    examine(board)


def set_up(talk: Talk, mode: SetMode, settling: int = 36, heartbeat: int = 10_000) -> None:
    talk.next(Hello, PATIENCE)
    drives = tuple(
        Drive(source, sink, mask)
        for (source, sink), mask in zip(SCAN.drives.tolist(), SCAN.masks.tolist(), strict=True)
    )
    for command in (
        SetScan(1, 5, len(drives), settling, 5, 4, 64, 100_000),
        SetPattern(2, 5, 0, drives),
        SetHeartbeat(3, heartbeat),
        mode,
    ):
        assert ask(talk, command).result is Result.OK


def ask(talk: Talk, command: object) -> Ack:
    talk.say(command)  # type: ignore[arg-type]
    answer: Ack = talk.next(Ack, PATIENCE)
    return answer


def insist(talk: Talk, command: object) -> Ack:
    """Say it until it is answered, as a host does: a full ring drops bytes."""
    end = time.monotonic() + PATIENCE
    while True:
        talk.say(command)  # type: ignore[arg-type]
        try:
            answer: Ack = talk.next(Ack, AGAIN)
        except AssertionError:
            if time.monotonic() > end:
                raise
        else:
            return answer


def test_the_board_refuses_what_is_too_fast_with_its_limit(board: Powered) -> None:
    talk = Talk(SerialTransport(board.process.port))
    frequency = board.kind.settings.chop_frequency
    set_up(talk, SetMode(4, 5, DriveMode.CHOPPED, frequency, 2), settling=2000)
    talk.say(GetBoard(9))
    limits: BoardLimits = talk.next(BoardLimits, PATIENCE)
    half = limits.half + 5000 + 4000 * 501 + 6 * (limits.sample + limits.conversion)
    limit = int(5e8 // (half + 6 * limits.clock * 64))
    refused = ask(talk, Start(10, 5))
    assert (refused.result, refused.detail) == (Result.CHOP_TOO_FAST, limit)
    odd = ask(talk, SetMode(11, 5, DriveMode.CHOPPED, 100, 3))
    assert odd.result is Result.BAD_VALUE
    beyond = ask(talk, SetMode(12, 5, DriveMode.CHOPPED, limits.max_chop + 1, 2))
    assert (beyond.result, beyond.detail) == (Result.CHOP_TOO_FAST, limits.max_chop)
    assert ask(talk, SetMode(13, 5, DriveMode.CHOPPED, limit, 2)).result is Result.OK
    assert ask(talk, Start(14, 5)).result is Result.OK
    assert talk.next(Frame, PATIENCE).sequence == 0
    talk.transport.close()


def test_the_host_refuses_before_it_sets_anything(board: Powered) -> None:
    settings = ScanSettings(4, 2e-3, CURRENT, board.kind.bits, chop_frequency=260)
    with (
        Link(SerialTransport(board.process.port), SCAN, settings) as link,
        pytest.raises(SourceError, match=rf"the {board.kind.text} does at most \d+ Hz"),
    ):
        link.connect()


def test_off_in_whichever_direction(board: Powered) -> None:
    """STOP and SAFE_OFF at many moments, so in both directions; then silence."""
    talk = Talk(SerialTransport(board.process.port))
    mode = SetMode(4, 5, DriveMode.CHOPPED, board.kind.settings.chop_frequency, 2)
    settling = round(board.kind.settings.settling * 1e6)
    set_up(talk, mode, settling)
    for request in range(20, 40, 2):
        assert ask(talk, Start(request, 5)).result is Result.OK
        talk.next(Frame, PATIENCE)
        assert ask(talk, Stop(request + 1)).result is Result.OK
        board.until(lambda seen: not seen.connected)
    assert ask(talk, SetHeartbeat(50, 100)).result is Result.OK
    assert ask(talk, Start(51, 5)).result is Result.OK
    talk.next(Fault, PATIENCE)
    board.until(lambda seen: not seen.connected)
    talk.next(Hello, PATIENCE)
    assert ask(talk, SafeOff(52)).result is Result.OK
    assert ask(talk, Start(53, 5)).result is Result.WRONG_CONFIGURATION
    talk.transport.close()
    assert board.look().longest_on <= 0.5 / mode.frequency + board.kind.lateness


def test_a_host_that_talks_without_end_does_not_lengthen_a_drive(board: Powered) -> None:
    """Bytes that come while others are sent take the processor nearly whole."""
    talk = Talk(SerialTransport(board.process.port))
    frequency = board.kind.settings.chop_frequency
    settling = round(board.kind.settings.settling * 1e6)
    set_up(talk, SetMode(4, 5, DriveMode.CHOPPED, frequency, 2), settling)
    assert ask(talk, Start(20, 5)).result is Result.OK
    for _ in range(20):
        talk.transport.write(encode(Ping(30)) * 20)
        talk.next(Frame, PATIENCE)
        talk.next(Frame, PATIENCE)
    assert insist(talk, Stop(21)).result is Result.OK
    talk.transport.close()
    assert board.look().longest_on <= 0.5 / frequency + board.kind.lateness


def test_a_pico_refuses_neighbours(pico: BoardPrograms, tmp_path: Path) -> None:
    kind, neighbours = KINDS["pico"], Scan.of(Pattern.adjacent(N))
    with powered(pico, kind, tmp_path) as board:
        port = board.process.port
        with (
            Link(SerialTransport(port), neighbours, kind.settings) as link,
            pytest.raises(SourceError, match="8 cannot be read alternately"),
        ):
            link.connect()
        talk = Talk(SerialTransport(port))
        set_up(talk, SetMode(4, 5, DriveMode.CHOPPED, kind.settings.chop_frequency, 2))
        pair = Drive(1, 0, 0xFC)
        assert ask(talk, SetPattern(5, 5, 3, (pair,))).result is Result.OK
        refused = ask(talk, Start(6, 5))
        assert (refused.result, refused.detail) == (Result.DRIVEN_REFERENCE, 3)
        talk.transport.close()


MUTANTS = {
    "a current that never turns": ("src/scan.c", "(scan.direction & 1u) != 0u", "false"),
    "directions exchanged": ("src/scan.c", "channel, reversed(), sum", "channel, !reversed(), sum"),
    "one direction longer": (
        "src/scan.c",
        "hal_timer_extend(scan.on_ticks);",
        "hal_timer_extend((uint16_t)(scan.on_ticks - (reversed() ? 6u : 0u)));",
    ),
    "sums that are not cleared": ("src/scan.c", "    }\n    demodulator_clear();\n", "    }\n"),
    "a half that is not held": (
        "src/scan.c",
        "    scan.phase = HOLDING;\n    hal_timer_extend(scan.on_ticks);",
        "    end_direction();",
    ),
    "no break": ("src/switches.c", "    hal_switches_disable();\n", ""),
}
LETS_NEIGHBOURS_THROUGH = ("pico/hal_pico.c", "    return true; /* U5", "    return false; /* U5")


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTANTS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_mutant_is_noticed(
    name: str, kind: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    change = MUTANTS[name]
    if kind == "pico":
        programs: BoardPrograms = mutated_image(request.getfixturevalue("pico"), tmp_path, change)
    else:
        whole = request.getfixturevalue("programs")
        programs = type(whole)(mutated_elf([change], tmp_path), whole.emulator)
    with pytest.raises(AssertionError), powered(programs, KINDS[kind], tmp_path) as board:
        examine(board)


@pytest.mark.slow
def test_a_pico_that_lets_neighbours_through_is_noticed(pico: PicoPrograms, tmp_path: Path) -> None:
    planted = mutated_image(pico, tmp_path, LETS_NEIGHBOURS_THROUGH)
    with pytest.raises(AssertionError):
        test_a_pico_refuses_neighbours(planted, tmp_path)
