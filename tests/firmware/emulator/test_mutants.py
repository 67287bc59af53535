"""The ELF keeps its current bounded whatever happens, and the tests notice one that does not.

Each mutant is the whole firmware with a planted mistake, built for the ATmega2560 and run in the
emulator; the examination that passes the real ELF must fail it.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest

from firmware.boards import FIRMWARE, SCAN, Process, Talk, make, star_counts
from firmware.emulator.watch import CLOCK, Watch
from tomoskin.board.source import SerialTransport
from tomoskin.board.wire import (
    Ack,
    Drive,
    Fault,
    FaultCode,
    Hello,
    Result,
    SetHeartbeat,
    SetPattern,
    SetScan,
    Start,
)
from tomoskin.core import Frame
from tomoskin_emulator.program import Programs

SETTLING, DEAD, OVERSAMPLING = 200, 45, 2
LONGEST_ON = 1e-6 * SETTLING + 2 * 6 * OVERSAMPLING * 14 * 64 / CLOCK + 2.5e-3
"""s: settling time, twice the conversions, and the guard's slack."""
WATCHDOG = 0.15
"""s: the datasheet's 120 ms, and what its oscillator may be off."""
PATIENCE, IMPATIENCE = 20.0, 2.0
"""s to wait for a message: of the real one, and of a mutant that may never send it."""

HANG = (
    "src/scan.c",
    "    if (scan.phase != CONVERTING) {",
    "    for (; scan.sequence == 6u;) {\n    }\n",
)
STALL = ("src/board.c", "    mind_scan();\n    receive", "    for (; scan_running();) {\n    }\n")
NO_WATCHDOG = ("avr/hal_avr.c", "wdt_enable(WDTO_120MS);", "")

MUTANTS = {
    "swapped demultiplexers": [
        (
            "avr/hal_avr.c",
            "(source & 7u) | (uint8_t)((sink & 7u) << SINK_SHIFT)",
            "(sink & 7u) | (uint8_t)((source & 7u) << SINK_SHIFT)",
        )
    ],
    "no dead time": [
        (
            "src/switches.c",
            "hal_delay_us(dead_time > LEAST_DEAD_TIME_US ? dead_time : LEAST_DEAD_TIME_US);",
            "(void)dead_time;",
        )
    ],
    "no break": [("src/switches.c", "    hal_switches_disable();\n", "")],
    "hang with current on": [(*HANG[:2], HANG[2] + HANG[1]), NO_WATCHDOG],
    "stuck sequence number": [("src/scan.c", "    scan.sequence++;\n", "")],
    "a source on before main": [
        (
            "avr/hal_avr.c",
            "    CONTROL_PORT = LATCH;\n    CONTROL_DDR",
            "    CONTROL_PORT = LATCH | SOURCE_ENABLE_0;\n    CONTROL_DDR",
        )
    ],
    "host silence ignored": [("src/board.c", "if (board.hello_due ||", "if (true ||")],
    "converter on the wrong channel": [
        ("avr/hal_avr.c", "_BV(REFS0) | (channel & 7u)", "_BV(REFS0) | (channel & 3u)")
    ],
}


@dataclass
class Examined:
    """What was wrong, in words, and what the emulator saw."""

    wrong: list[str]
    watch: Watch
    faults: list[FaultCode]


def mutated(changes: list[tuple[str, str, str]], folder: Path) -> Path:
    """The ELF of a copy of the firmware with ``changes``."""
    copy = folder / "firmware"
    shutil.copytree(FIRMWARE, copy)
    for file, old, new in changes:
        text = (copy / file).read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{file}: {old} is gone or not the only one"
        (copy / file).write_text(text.replace(old, new), encoding="utf-8")
    made = make("avr", f"BUILD={folder}", "CFLAGS=", folder=copy)
    assert made.returncode == 0, made.stderr
    return folder / "tomoskin-16.elf"


def examine(
    programs: Programs, elf: Path, folder: Path, patience: float = IMPATIENCE, *options: str
) -> Examined:
    """Scan, fall silent, and look at values, numbers, switches and time."""
    seen = ("-w", str(folder / "watch"), *options)
    board = Process(programs.emulator, folder / "port", "-f", *seen, str(elf))
    talk = Talk(SerialTransport(board.path))
    wrong: list[str] = []
    try:
        _scan(talk, wrong, patience)
    except AssertionError as error:
        wrong.append(str(error))
    faults = [message.code for message in talk.seen if isinstance(message, Fault)]
    talk.transport.close()
    board.kill()
    watch = Watch.read(folder / "watch")
    if watch.on > LONGEST_ON * CLOCK:
        wrong.append(f"a drive was on for {1e3 * watch.on / CLOCK:.1f} ms")
    if watch.shortest_off < DEAD * 1e-6 * CLOCK:
        wrong.append(f"dead time of {1e6 * watch.shortest_off / CLOCK:.1f} us")
    if watch.connected:
        wrong.append("the current is on at the end")
    wrong += board.said().splitlines()
    return Examined(wrong, watch, faults)


def _scan(talk: Talk, wrong: list[str], patience: float) -> None:
    """Ten frames, then silence until the board says HELLO again."""
    talk.next(Hello, patience)
    drives = tuple(
        Drive(source, sink, mask)
        for (source, sink), mask in zip(SCAN.drives.tolist(), SCAN.masks.tolist(), strict=True)
    )
    for command in (
        SetScan(1, 5, len(drives), SETTLING, DEAD, OVERSAMPLING, 64, 100_000),
        SetPattern(2, 5, 0, drives),
        SetHeartbeat(3, 200),
        Start(4, 5),
    ):
        talk.say(command)
        assert talk.next(Ack, patience).result is Result.OK
    for number in range(10):
        frame = talk.next(Frame, patience)
        if frame.sequence != number:
            wrong.append(f"frame {number} calls itself {frame.sequence}")
        if frame.samples.tolist() != star_counts(OVERSAMPLING):
            wrong.append(f"frame {number} has wrong samples")
    talk.next(Hello, patience)


def test_the_real_one_passes(programs: Programs, tmp_path: Path) -> None:
    found = examine(programs, programs.elf, tmp_path, PATIENCE)
    assert found.wrong == []
    assert found.faults == [FaultCode.HOST_SILENT]
    assert found.watch.resets == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTANTS)
def test_a_mutant_does_not(name: str, programs: Programs, tmp_path: Path) -> None:
    found = examine(programs, mutated(MUTANTS[name], tmp_path), tmp_path)
    assert found.wrong, f"nothing noticed: {name}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hang", "longest"),
    [(HANG, WATCHDOG), (STALL, LONGEST_ON)],
    ids=["in an interrupt, with current on", "of the main loop, while the scan goes on"],
)
def test_the_watchdog_ends_a_hang(
    programs: Programs, tmp_path: Path, hang: tuple[str, str, str], longest: float
) -> None:
    file, place, planted = hang
    found = examine(programs, mutated([(file, place, planted + place)], tmp_path), tmp_path)
    assert found.watch.resets == 1
    assert found.faults == [FaultCode.WATCHDOG]
    assert not found.watch.connected
    assert 0 < found.watch.on <= longest * CLOCK


@pytest.mark.slow
def test_the_watchdog_is_named_behind_a_bootloader_that_hides_it(
    programs: Programs, tmp_path: Path
) -> None:
    """The stock one clears the register that says it; opening the port is the other reset."""
    file, place, planted = STALL
    elf = mutated([(file, place, planted + place)], tmp_path)
    found = examine(programs, elf, tmp_path, PATIENCE, "-r")
    assert found.watch.resets == 2
    assert found.faults == [FaultCode.WATCHDOG]


CLOCK_PROGRAM = FIRMWARE / "tests" / "avr" / "ticks.c"
UNLOCKED = ("avr/hal_avr.c", "    cli();\n    uint16_t low", "    uint16_t low")


def clock_jumps(programs: Programs, folder: Path, *changes: tuple[str, str, str]) -> bool:
    """Whether the clock jumps where its halves meet, of a firmware with ``changes``."""
    main = (FIRMWARE / "src" / "main.c").read_text(encoding="utf-8")
    program = ("src/main.c", main, CLOCK_PROGRAM.read_text(encoding="utf-8"))
    board = Process(programs.emulator, folder / "port", str(mutated([program, *changes], folder)))
    transport = SerialTransport(board.path)
    said = b""
    while len(said) < 4:
        said += transport.read(0.1)
    transport.close()
    board.end()
    assert set(said) <= set(b".x")
    return b"x" in said


def test_the_clock_does_not_jump(programs: Programs, tmp_path: Path) -> None:
    assert not clock_jumps(programs, tmp_path)


@pytest.mark.slow
def test_a_clock_that_is_interrupted_does(programs: Programs, tmp_path: Path) -> None:
    assert clock_jumps(programs, tmp_path, UNLOCKED)
