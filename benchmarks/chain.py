"""From boards to touches, page and recording: one of 400 frames/s on one core, eight at once."""

from __future__ import annotations

import contextlib
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np

from bench_rig import served
from report import Report, progress, table
from tomoskin.board.source import SerialTransport
from tomoskin.core import FloatArray
from tomoskin.extras.robot import Member, PlaceOnRobot, RobotRun
from tomoskin.files.session import SessionReader
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Prepared, prepare
from tomoskin.run import LiveSkin, Runner, commands
from tomoskin.run.sinks import Contacts
from tomoskin.twin import Press, TwinSettings, TwinSkin
from tomoskin_emulator.board_process import SkinMemory
from tomoskin_emulator.program import BUILD, make_firmware
from tomoskin_emulator.source import front_of

SKIN, SEED = "textile-disc-8", 5
SETTLING = "228 us"
"""With 4 conversions of 12 bits a sample: 404 frames/s."""

SECONDS = 60.0
LEAD = 10.0
"""Seconds in which the reference is taken; what the first frames cost does not count as latency."""

STEPS, STEP = 60, 0.1
"""Places of the presses, and s at each: one press, two, none, twenty steps each."""

WAIT = 0.1
"""Seconds for which the control loop waits at most."""

PROMISED = 5.0
"""ms from bytes to touches, 99 of 100."""

_READER = """
import sys
from websockets.sync.client import connect
with connect(sys.argv[1], max_size=None) as page:
    print("open", flush=True)
    for message in page:
        pass
"""


def run() -> Iterator[Report]:
    yield measured(SECONDS)


def run_long() -> Iterator[Report]:
    """The same as chain, for ten minutes."""
    yield measured(10 * SECONDS)


def measured(seconds: float) -> Report:
    """The whole chain for ``seconds`` after the reference."""
    prepared = prepared_chain()
    progress(f"{seconds:.0f} s")
    with tempfile.TemporaryDirectory() as folder:
        row, touches = _ran(prepared, Path(folder), seconds)
    return table(
        f"{seconds:.0f} s of frames to touches, page and recording",
        [row],
        f"firmware with a Pico's timing on a pty; presses that go round; {SKIN}, seed {SEED}",
        "read → touches: from a frame's bytes to the control loop of the same program; "
        f"promised: 99 of 100 within {PROMISED:g} ms",
        f"{touches:,} touches; load of the machine {os.getloadavg()[0]:.0f}",
    )


def prepared_chain(name: str = SKIN, settling: str = SETTLING) -> Prepared:
    """A skin at that settling, with the tables of its fit."""
    prepared = prepare(Skin.load(name).altered({"readout": {"settling": settling}}))
    prepared.warm_up()
    return prepared


@contextmanager
def control_loop(runner: Runner, heard: Callable[[Contacts], None]) -> Iterator[None]:
    """A thread of this program that waits for news of the skin, while the block lasts."""
    skin, ended = LiveSkin(runner), threading.Event()

    def follow() -> None:
        while not ended.is_set():
            heard(skin.wait(WAIT))

    thread = threading.Thread(target=follow)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _ran(prepared: Prepared, folder: Path, seconds: float) -> tuple[dict[str, Any], int]:
    """A row, and how many touches there were."""
    calls: list[tuple[int, float, float, int]] = []

    def heard(contacts: Contacts) -> None:
        now, touches = time.monotonic(), len(contacts.touches)
        if contacts.sequence >= 0 and (not calls or contacts.host_time > calls[-1][1]):
            calls.append((contacts.sequence, contacts.host_time, now, touches))

    file = folder / "chain.mcap"
    with board(prepared.skin, folder) as (port, _):
        runner = Runner(prepared, lambda: SerialTransport(port))
        runner.ask(commands.Record(file))
        runner.start()
        with control_loop(runner, heard), page(runner):
            threading.Event().wait(LEAD)
            began, before = time.process_time(), time.monotonic()
            threading.Event().wait(seconds)
            used = (time.process_time() - began) / (time.monotonic() - before)
            status = runner.status()
        runner.stop()
    rate, rows = prepared.skin.readout.tick_rate, np.array(calls)
    frames = np.array(
        [
            (item.frame.sequence, item.frame.host_time, item.frame.ticks / rate)
            for item in SessionReader(file).frames()
        ]
    )
    read = (rows[:, 2] - rows[:, 1])[rows[:, 1] > before]
    without = int((frames[:, 1] > before).sum()) - int((rows[:, 1] > before).sum())
    return {
        "electrodes": prepared.pattern.n_electrodes,
        "frames/s": f"{(len(frames) - 1) / np.ptp(frames[:, 2]):.0f}",
        "recorded": len(frames),
        "lost": int(frames[-1, 0] - frames[0, 0]) + 1 - len(frames),
        "corrupt": status.corrupt,
        "without touches: first seconds": len(frames) - len(rows) - without,
        "later": without,
        "read → touches: p50, ms": f"{1e3 * np.median(read):.2f}",
        "p99": f"{1e3 * np.percentile(read, 99):.2f}",
        "longest": f"{1e3 * read.max():.2f}",
        "of one core": f"{100 * used:.0f} %",
    }, int(rows[:, 3].sum())


@contextmanager
def board(skin: Skin, folder: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The port and process of the host-built board; on its sheet presses go round."""
    make_firmware(("make", "cc"), "make gcc", "fast")
    settings = TwinSettings.preset("textile", SEED)
    sheets = _sheets(skin, settings)
    memory = SkinMemory(folder / "skin", front_of(skin, settings, "pico"), sheets[0])
    microamperes = str(round(1e6 * skin.current))
    process = elsewhere(
        [str(BUILD / "tomoskin-board-fast"), "-s", str(memory.path), "-c", microamperes]
    )
    assert process.stdout is not None
    port = process.stdout.readline().strip()
    done = threading.Event()
    thread = threading.Thread(target=_press, args=(memory, sheets, done))
    thread.start()
    try:
        yield port, process
    finally:
        done.set()
        thread.join()
        process.kill()
        process.communicate()
        memory.close()


def _sheets(skin: Skin, settings: TwinSettings) -> list[FloatArray]:
    """Transfer resistances of the sheet at rest, then under the presses step by step."""
    sheet = TwinSkin.of(skin, settings)
    sheets = [sheet.resistance()]
    for step in range(STEPS):
        presses = (1, 2, 0)[step * 3 // STEPS]
        turns = [2 * math.pi * (step / STEPS + k / 2) for k in range(presses)]
        sheet.set_presses(
            tuple(Press(0.05 * math.cos(a), 0.05 * math.sin(a), 5.0, 0.012) for a in turns)
        )
        sheet.advance(STEP)
        sheets.append(sheet.resistance())
    return sheets


def _press(memory: SkinMemory, sheets: list[FloatArray], done: threading.Event) -> None:
    """Nothing presses until the reference stands; then the steps in turn."""
    done.wait(LEAD)
    step = 0
    while not done.wait(STEP):
        memory.write(sheets[1 + step % STEPS])
        step += 1


@contextmanager
def page(runner: Runner) -> Iterator[None]:
    """The server, and a page that reads all that it is sent, in another process."""
    with served(runner) as policy:
        address = f"ws://127.0.0.1:{policy.port}/ws?token={policy.token}"
        reader = elsewhere([sys.executable, "-c", _READER, address])
        try:
            assert reader.stdout is not None
            assert reader.stdout.readline().strip() == "open"
            yield
        finally:
            reader.kill()
            reader.communicate()


def elsewhere(words: list[str], out: IO[str] | int = subprocess.PIPE) -> subprocess.Popen[str]:
    """A process on the cores that this one does not use, where there are any."""
    others = set(range(os.cpu_count() or 1)) - os.sched_getaffinity(0)
    process = subprocess.Popen(words, stdout=out, text=True)
    if others:
        os.sched_setaffinity(process.pid, others)
    return process


BOARDS, BOARDS_SKIN, BOARDS_SETTLING = 8, "textile-disc-16", "507 us"
"""With 16 electrodes: 100 frames/s."""

BOARDS_SECONDS, BOARDS_PROMISED = 600.0, 10.0
"""ms from the last byte of a frame to its message, 99 of 100."""


def run_boards() -> Iterator[Report]:
    """Eight boards of 16 electrodes in one program, recorded and shown, for ten minutes."""
    prepared = prepared_chain(BOARDS_SKIN, BOARDS_SETTLING)
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        ports = []
        for number in range(BOARDS):
            place = Path(folder) / f"board{number}"
            place.mkdir()
            ports.append(stack.enter_context(board(prepared.skin, place))[0])
        row = _several(prepared, Path(folder) / "boards.mcap", ports, BOARDS_SECONDS)
    yield table(
        f"{BOARDS} boards of 16 electrodes in one program",
        [row],
        f"firmware with a Pico's timing on ptys; presses that go round; {BOARDS_SKIN}, seed "
        f"{SEED}; one recording, one page",
        f"due → message: from a frame's last byte, by the board's clock, whose offset is that of "
        f"the frame that was read soonest; promised: 99 of 100 within {BOARDS_PROMISED:g} ms",
        f"load of the machine {os.getloadavg()[0]:.0f}",
    )


def _several(prepared: Prepared, file: Path, ports: list[str], seconds: float) -> dict[str, Any]:
    members = [
        Member(PlaceOnRobot(f"skin{number}"), prepared, partial(SerialTransport, port))
        for number, port in enumerate(ports)
    ]
    told: dict[str, list[tuple[int, float, float]]] = {}

    def take(name: str, result: FrameResult) -> None:
        told[name].append((result.sequence, result.host_time, time.monotonic()))

    with RobotRun(members) as run, contextlib.ExitStack() as stack:
        run.start()
        run.record(file)
        for name, runner in run.runners.items():
            told[name] = []
            stack.enter_context(runner.audience.subscribe("ages", partial(take, name)))
        stack.enter_context(page(next(iter(run.runners.values()))))
        threading.Event().wait(LEAD)
        dropped = sum(state.dropped for state in run.statuses().values())
        began, before = time.process_time(), time.monotonic()
        threading.Event().wait(seconds)
        used, took = time.process_time() - began, time.monotonic() - before
        dropped = sum(state.dropped for state in run.statuses().values()) - dropped
    numbers, late = [], list[float]()
    for name, rows in told.items():
        with SessionReader(file, name) as session:
            steps = np.diff([[i.frame.sequence, i.frame.ticks] for i in session.frames()], axis=0)
        numbers.append(steps[:, 0])
        interval = float(np.median(steps[:, 1])) / prepared.skin.readout.tick_rate
        every = np.array(rows)
        for part in np.split(every, np.flatnonzero(np.diff(every[:, 0]) < 0) + 1):
            due = part[:, 0] * interval + (part[:, 1] - part[:, 0] * interval).min()
            late += (1e3 * (part[:, 2] - due))[part[:, 2] > before].tolist()
    onward = np.concatenate(numbers)
    return {
        "frames/s a board": f"{1 / interval:.0f}",
        "recorded": len(onward) + len(told),
        "lost": int(np.maximum(onward - 1, 0).sum()),
        "begun again": int((onward < 0).sum()),
        "without touches": dropped,
        "due → message: p50, ms": f"{np.median(late):.2f}",
        "p99": f"{np.percentile(late, 99):.2f}",
        "longest": f"{max(late):.1f}",
        "processor a frame, ms": f"{1e3 * used / len(late):.2f}",
        "of one core": f"{100 * used / took:.0f} %",
    }
