"""The real image of the Pico on a simulated RP2040: handshake, scan, rate, safety."""

from __future__ import annotations

import shutil
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from firmware.boards import FIRMWARE, SCAN, Talk, make
from firmware.emulator.faulty import BoardFaults
from firmware.emulator.pico import CURRENT, PATIENCE, Pico, events_of, frames_of, powered, star
from tomoskin.board.source import Link, ScanSettings, SerialTransport, Timing
from tomoskin.board.wire import (
    SCHEMA,
    Ack,
    Command,
    Drive,
    Fault,
    FaultCode,
    GetInfo,
    Hello,
    Info,
    Ping,
    Reset,
    Result,
    SafeOff,
    SetFormat,
    SetHeartbeat,
    SetPattern,
    SetScan,
    Start,
    Stop,
)
from tomoskin.board.wire.messages import Format
from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.run import Runner
from tomoskin.twin import TwinSettings, TwinSkin
from tomoskin_emulator.board_process import BoardProcess, SkinMemory
from tomoskin_emulator.program import PicoPrograms, pack_uf2
from tomoskin_emulator.source import front_of, open_emulator

SETTLING = 84e-6
"""s: the slowest that the decks give."""
DEAD = 5e-6
LEAST_RATE = {8: 400, 16: 150, 32: 60}
"""Frames/s, adjacent, four readings."""
MOST_JITTER = 1000
"""ns by which one and the same conversion may move against its drive."""
WATCHDOG = 0.15
"""s: 120 ms, and how far its oscillator may be off."""
SETTINGS = ScanSettings(4, SETTLING, CURRENT, adc_bits=12, dead_time=DEAD)


@pytest.mark.parametrize("electrodes", [8, pytest.param(16, marks=pytest.mark.slow), 32])
def test_scans_in_order_at_its_rate_and_samples_on_time(
    pico: PicoPrograms, tmp_path: Path, electrodes: int
) -> None:
    scan = Scan.of(Pattern.adjacent(electrodes))
    with powered(pico, tmp_path, "-f") as board, board.link(scan, SETTINGS) as link:
        info = link.connect()
        frames = frames_of(link, 20)
        board.until(lambda seen: seen["drives"] >= 20 * electrodes)
        seen = board.watch()
        assert link.counters.corrupt == 0
        assert link.frames.lost == 0
    assert (info.channels, info.adc_bits, info.reset) == (32, 12, Reset.POWER)
    assert (info.unique_id, info.schema_hash) == (b"emulated", SCHEMA.hash)
    assert seen["serial"] == b"emulated".hex().upper()
    assert [frame.sequence for frame in frames] == list(range(20))
    for frame in frames:
        assert frame.samples.tolist() == star(scan, 4)
    periods = np.diff([frame.ticks for frame in frames]) / info.tick_rate
    assert 1 / periods.mean() > LEAST_RATE[electrodes]
    assert seen["instants"] > scan.n_samples * 4
    assert seen["unsettled"] > 4
    assert seen["jitter"] < MOST_JITTER
    assert seen["shortestOff"] >= 1e9 * DEAD
    assert seen["resets"] == 0


FASTER_THAN = {8: 380, 32: 55}
"""Frames/s with the front end's converter, which drops three conversions."""


@pytest.mark.parametrize("electrodes", [8, 32])
def test_the_converter_of_the_front_end_is_read_where_it_answers(
    pico: PicoPrograms, tmp_path: Path, electrodes: int
) -> None:
    scan = Scan.of(Pattern.adjacent(electrodes))
    with powered(pico, tmp_path, "-f", "-a") as board, board.link(scan, SETTINGS) as link:
        link.connect()
        limits = link.session.board
        frames = frames_of(link, 20)
        board.until(lambda seen: seen["drives"] >= 20 * electrodes)
        seen = board.watch()
        assert link.frames.lost == link.frames.late == link.counters.corrupt == 0
    assert limits is not None
    assert limits.sample == 8000
    for frame in frames:
        assert frame.samples.tolist() == star(scan, 4)
    periods = np.diff([frame.ticks for frame in frames]) / 250e3
    assert 1 / np.median(periods) > FASTER_THAN[electrodes]
    assert seen["instants"] > scan.n_samples * 4
    assert seen["unsettled"] > 4
    assert seen["jitter"] < MOST_JITTER
    assert seen["shortestOff"] >= 1e9 * DEAD


Change = tuple[str, str, str]
MUTANTS: dict[str, Change] = {
    "source and sink swapped": (
        "pico/hal_pico.c",
        "((uint32_t)source << SOURCE_SHIFT) | ((uint32_t)sink << SINK_SHIFT)",
        "((uint32_t)sink << SOURCE_SHIFT) | ((uint32_t)source << SINK_SHIFT)",
    ),
    "no dead time": (
        "src/switches.c",
        "hal_delay_us(dead_time > LEAST_DEAD_TIME_US ? dead_time : LEAST_DEAD_TIME_US);",
        "(void)dead_time;",
    ),
    "no break": ("src/switches.c", "    hal_switches_disable();\n", ""),
    "no latch": ("pico/hal_pico.c", "    REGISTER(SIO_OUT_CLR) = LATCH;\n", ""),
    "the multiplexer has no time": ("pico/converter.c", "#define DROPPED 2u", "#define DROPPED 0u"),
    "the channel before": (
        "pico/converter.c",
        "channel << READ_SHIFT",
        "(channel ^ 1u) << READ_SHIFT",
    ),
    "settling by the ticks of a microsecond": (
        "pico/hal_pico.c",
        "    while (cycles_since(timer_from) < timer_cycles) {\n    }\n",
        "",
    ),
    "a pulled plug ignored": ("pico/usb.c", "return configured && !suspended;", "return true;"),
    "a regulator that bursts": (
        "pico/hal_pico.c",
        "    REGISTER(GPIO_CTRL(REGULATOR_PIN)) = GPIO_SIO;\n",
        "",
    ),
    "USB before the scan": ("pico/hal_pico.c", "#define LOWEST 0xC0u", "#define LOWEST 0x00u"),
    "host silence ignored": ("src/board.c", "if (board.hello_due ||", "if (true ||"),
    "a bit of the address to read": (
        "pico/converter.c",
        "& (ADDRESS_MASK << READ_SHIFT)",
        "& (3u << READ_SHIFT)",
    ),
    "two bits of the addresses to drive": (
        "pico/pins.h",
        "#define ADDRESS_MASK 0x1Fu",
        "#define ADDRESS_MASK 0x03u",
    ),
    "the sink stays connected": (
        "pico/hal_pico.c",
        "REGISTER(SIO_OUT_CLR) = SOURCE_ENABLE | SINK_ENABLE;",
        "REGISTER(SIO_OUT_CLR) = SOURCE_ENABLE;",
    ),
    "the main loop sleeps on": (
        "pico/hal_pico.c",
        "void hal_wake(void) {\n    awake = true;",
        "void hal_wake(void) {",
    ),
    "an id of its own": ("pico/flash.c", "#define ID_AT 5u", "#define ID_AT 4u"),
}


def late(pause: str) -> Change:
    """Every fifth interrupt of the converter comes later than one may; 5 and 8 share no divisor."""
    return (
        "pico/converter.c",
        "    uint32_t sum = 0u;\n",
        "    static uint8_t turn;\n    uint32_t sum = 0u;\n    if (++turn == 5u) {\n"
        f"        turn = 0u;\n        {pause}\n    }}\n",
    )


HEARTBEAT = 10_000
"""ms of silence, far more than a board takes to see that its plug is out."""
LATE = late("for (volatile uint8_t wait = 0u; wait < 6u; wait++) {\n        }")
"""By half a microsecond; beside the main loop's lock, the multiplexer still has its time."""
LATER = late("hal_delay_us(1u);")
"""So late that the next conversion has ended."""
DRAINS: Change = ("pico/converter.c", "if (runs()) {", "if (runs() && false) {")
LONGEST_ON = 5e-3
"""s that a drive is on here, with its guard's slack; what a reset ends has been on for longer."""
STAYS_ON: Change = (
    "pico/start.c",
    "void on_fault(void) {\n    switches_off();",
    "void on_fault(void) {",
)
AFTER_A_FAULT = "after an instruction that is none"
HANGS: dict[str, Change] = {
    "in an interrupt, with current on": (
        "src/scan.c",
        "    if (scan.phase != CONVERTING) {",
        "    for (; scan.sequence == 6u;) {\n    }\n    if (scan.phase != CONVERTING) {",
    ),
    "of the main loop": (
        "src/board.c",
        "    mind_scan();\n    receive",
        "    for (; scan_running();) {\n    }\n    mind_scan();\n    receive",
    ),
    AFTER_A_FAULT: (
        "src/scan.c",
        "    if (scan.phase != CONVERTING) {",
        "    if (scan.sequence == 6u) {\n        void on_fault(void);\n        on_fault();\n    }\n"
        "    if (scan.phase != CONVERTING) {",
    ),
}


def mutated(pico: PicoPrograms, folder: Path, *changes: Change) -> PicoPrograms:
    """The image of a copy of the firmware with ``changes``."""
    copy = folder / "firmware"
    shutil.copytree(FIRMWARE, copy, ignore=shutil.ignore_patterns("node_modules"))
    for file, old, new in changes:
        text = (copy / file).read_text(encoding="utf-8")
        assert text.count(old) == 1, f"{file}: {old} is gone or not the only one"
        (copy / file).write_text(text.replace(old, new), encoding="utf-8")
    made = make("pico", f"BUILD={folder}", "CHANNELS=32", folder=copy)
    assert made.returncode == 0, made.stderr
    image = folder / "mutant.uf2"
    image.write_bytes(pack_uf2((folder / "tomoskin-pico-32.bin").read_bytes()))
    return PicoPrograms(image, pico.node)


def examine(programs: PicoPrograms, folder: Path, impatience: float = PATIENCE) -> int:
    """Scan, pull the plug, fall silent; how often the watchdog struck. AssertionError says what is
    wrong."""
    with powered(programs, folder, "-f") as board:
        talk = Talk(SerialTransport(board.board.port))
        set_up(talk, impatience=impatience)
        assert asked(talk, GetInfo(5), impatience, Info).unique_id == b"emulated"
        assert asked(talk, Start(10, 5)).result is Result.OK
        for number in range(30):
            talk.say(Ping(20 + number))  # so that USB is busy at any time
            frame = talk.next(Frame, impatience)
            assert frame.sequence == number
            assert frame.samples.tolist() == star(SCAN, 1)
        seen = board.watch()
        assert seen["jitter"] < MOST_JITTER
        assert seen["unsettled"] > 1
        assert seen["shortestOff"] >= 1e9 * DEAD
        assert asked(talk, SetHeartbeat(11, HEARTBEAT)).result is Result.OK
        seen = board.watch()
        board.order("unplug")
        board.until(lambda seen: not seen["connected"] and stands(board), impatience)
        silence = 1e6 * HEARTBEAT * seen["drives"] / seen["now"]
        assert board.watch()["drives"] - seen["drives"] < silence / 2, "not the plug, but silence"
        board.order("plug")
        assert asked(talk, SetHeartbeat(12, 200)).result is Result.OK
        assert asked(talk, Start(13, 5)).result is Result.OK
        talk.next(Fault, impatience)
        talk.next(Hello, impatience)
        board.until(lambda seen: not seen["connected"], impatience)
        talk.transport.close()
        resets: int = board.watch()["resets"]
        return resets


def stands(board: Pico) -> bool:
    """Whether no drive begins within 5 ms of the board's time."""
    before = board.watch()
    board.until(lambda seen: seen["now"] > before["now"] + 5e6)
    return bool(board.watch()["drives"] == before["drives"])


def asked(talk: Talk, command: Command, patience: float = PATIENCE, kind: type = Ack) -> Any:
    """The answer to a command, within ``patience`` s."""
    talk.say(command)
    return talk.next(kind, patience)


def set_up(talk: Talk, heartbeat: int = 2000, impatience: float = PATIENCE) -> None:
    """Everything but START."""
    talk.next(Hello, impatience)
    drives = tuple(
        Drive(source, sink, mask)
        for (source, sink), mask in zip(SCAN.drives.tolist(), SCAN.masks.tolist(), strict=True)
    )
    for command in (
        SetScan(1, 5, len(drives), 84, 5, 1, 64, 100_000),
        SetPattern(2, 5, 0, drives),
        SetHeartbeat(3, heartbeat),
    ):
        assert asked(talk, command, impatience).result is Result.OK


def test_nothing_is_connected_before_start_after_stop_and_in_silence(
    pico: PicoPrograms, tmp_path: Path
) -> None:
    with powered(pico, tmp_path, "-f") as board:
        talk = Talk(SerialTransport(board.board.port))
        set_up(talk, heartbeat=200)
        packed = asked(talk, SetFormat(4, 5, Format.PACKED))
        assert packed.result is Result.BAD_VALUE  # ten bits are too few for its converter
        assert not board.watch()["drives"]
        for request, off in ((10, Stop), (20, SafeOff)):
            assert asked(talk, Start(request, 5)).result is Result.OK
            board.until(lambda seen: bool(seen["connected"] or seen["drives"]))
            assert asked(talk, off(request + 1)).result is Result.OK
            drives = board.watch()["drives"]
            board.until(lambda seen: not seen["connected"])
            asked(talk, Ping(request + 2))
            assert board.watch()["drives"] >= drives
        assert asked(talk, Start(30, 5)).result is Result.WRONG_CONFIGURATION
        talk.transport.close()
        assert board.watch()["longestOn"] < 1e6


def test_a_host_that_does_not_read_costs_whole_frames(pico: PicoPrograms, tmp_path: Path) -> None:
    settings = ScanSettings(1, SETTLING, CURRENT, adc_bits=12)
    patient = Timing(silence=PATIENCE)
    with (
        powered(pico, tmp_path, "-f") as board,
        Link(SerialTransport(board.board.port), SCAN, settings, timing=patient) as link,
    ):
        frames_of(link, 3)
        board.order("stall")
        board.until(lambda seen: bool(seen["stalled"]))
        drives = board.watch()["drives"]
        board.until(lambda seen: seen["drives"] > drives + 200)
        board.order("flow")
        frames = frames_of(link, 200)
        assert frames[-1].drops == link.frames.lost > 0
        assert link.counters.corrupt == 0
        for frame in frames:
            assert frame.samples.tolist() == star(SCAN, 1)


def test_one_skin_file_runs_on_either_board(
    pico: PicoPrograms, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: pico)
    quiet = TwinSettings.preset("ideal").with_noise(0.0)
    monkeypatch.setattr("tomoskin.twin.read_settings", lambda *_: quiet)
    skin = Skin.load("textile-disc-8")
    transport = open_emulator("pico", skin)
    with Link(transport, SCAN, ScanSettings.of(skin)) as link:
        samples = frames_of(link, 1)[0].samples
        assert transport.complaints == ""
    front, r = front_of(skin, quiet, "pico"), transport.sheet.resistance()
    (source, sink), e = SCAN.drives[SCAN.sample_drive].T, SCAN.sample_electrode
    volts = front.current * (r[source, e] - r[sink, e] - r[source, sink] + r[sink, sink])
    exact = (front.gain * volts + front.offset) / front.reference
    assert samples.tolist() == (4 * np.floor(4096 * exact)).astype(int).tolist()
    # which is the scale that the skin file asks for: sixteen conversions of 10 bits
    assert skin.readout.oversampling == 16
    np.testing.assert_allclose(samples, 16 * 1024 * exact, atol=4)


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTANTS)
def test_a_mutant_is_noticed(name: str, pico: PicoPrograms, tmp_path: Path) -> None:
    planted = mutated(pico, tmp_path, MUTANTS[name])
    with pytest.raises(AssertionError):
        examine(planted, tmp_path, impatience=20.0)


def test_the_real_one_passes_what_mutants_do_not(pico: PicoPrograms, tmp_path: Path) -> None:
    assert examine(pico, tmp_path) == 0


def test_an_interrupt_that_is_late_costs_no_conversion(pico: PicoPrograms, tmp_path: Path) -> None:
    assert examine(mutated(pico, tmp_path, LATE), tmp_path) == 0


@pytest.mark.slow
def test_a_conversion_lost_by_lateness_is_noticed(pico: PicoPrograms, tmp_path: Path) -> None:
    planted = mutated(pico, tmp_path, LATER, DRAINS)
    with pytest.raises(AssertionError, match=f"< {MOST_JITTER}"):
        examine(planted, tmp_path, impatience=20.0)


def end_a_hang(programs: PicoPrograms, folder: Path) -> float:
    """Scan until the watchdog strikes; the longest time that a drive was on, s."""
    with powered(programs, folder, "-f") as board:
        talk = Talk(SerialTransport(board.board.port))
        set_up(talk)
        talk.say(Start(10, 5))
        board.until(lambda seen: seen["resets"] == 1)
        assert talk.next(Fault, PATIENCE).code is FaultCode.WATCHDOG
        seen = board.watch()
        assert not seen["connected"]
        talk.transport.close()
        return 1e-9 * float(seen["longestOn"])


@pytest.mark.slow
@pytest.mark.parametrize("name", HANGS)
def test_the_watchdog_ends_a_hang(name: str, pico: PicoPrograms, tmp_path: Path) -> None:
    on = end_a_hang(mutated(pico, tmp_path, HANGS[name]), tmp_path)
    assert on < (LONGEST_ON if name == AFTER_A_FAULT else WATCHDOG)


@pytest.mark.slow
def test_a_fault_that_leaves_the_switches_on_is_noticed(pico: PicoPrograms, tmp_path: Path) -> None:
    on = end_a_hang(mutated(pico, tmp_path, HANGS[AFTER_A_FAULT], STAYS_ON), tmp_path)
    assert on > LONGEST_ON


def test_a_multiplexer_that_does_not_reach_an_electrode_is_named(
    pico: PicoPrograms, tmp_path: Path
) -> None:
    skin = Skin.load("textile-disc-8").altered({"readout": {"settling": "84 us"}})
    settings = TwinSettings.preset("textile", seed=2)
    resistance = TwinSkin.of(skin, settings).resistance()
    faults = BoardFaults(reading={2: 6}).pack()
    front = front_of(skin, settings, "pico")
    memory = SkinMemory(tmp_path / "skin", front, resistance, faults=faults)
    board = BoardProcess(pico, memory.path, skin.current, "-f")
    runner = Runner(prepare(skin), lambda: SerialTransport(board.port))
    came = threading.Event()
    with runner.audience.watch(came.set):
        runner.start()
        try:
            while not (sick := runner.status().electrodes):
                assert came.wait(PATIENCE), runner.status()
                came.clear()
        finally:
            runner.stop()
            board.close()
            memory.close()
    (electrode,) = sick
    assert electrode.text.startswith("E3 is stuck: it reads as E7 does under every drive")


def test_usb_that_stalls_is_said_and_so_is_its_end(pico: PicoPrograms, tmp_path: Path) -> None:
    timing = Timing(silence=0.3)
    with powered(pico, tmp_path, "-f") as board:
        transport = SerialTransport(board.board.port)
        with Link(transport, SCAN, SETTINGS, timing=timing) as link:
            frames_of(link, 3)
            board.order("stall")
            said = events_of(link, "silent")
            assert "no frame for" in said.text
            assert "check the board's power and cable" in said.text
            board.order("flow")
            # whichever comes first: a frame, or the answer to a heartbeat without one
            assert "again" in events_of(link, "resumed", "reset").text
            frames_of(link, 3)
            assert link.counters.corrupt == 0
