"""From boards to touches, page and recording: one of 400 frames/s on one core, eight at once."""

from __future__ import annotations

import contextlib
import math
import multiprocessing
import os
import pty
import select
import subprocess
import sys
import tempfile
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import IO, Any

import numpy as np

from bench_rig import Rig, load_example, served
from report import Report, progress, table
from tomoskin.board.source import Configuration, ScanSettings, SerialTransport
from tomoskin.board.wire import encode
from tomoskin.core import FloatArray, Frame
from tomoskin.files.session import SessionReader
from tomoskin.files.session.replay import ReplayBoard
from tomoskin.model.pattern import Scan
from tomoskin.model.robot import Place
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Prepared, prepare
from tomoskin.run import LiveSkin, Runner, commands
from tomoskin.run.robot_run import Member, RobotRun
from tomoskin.twin import Press, TwinSettings, TwinSkin
from tomoskin.twin.emulator.board_process import SkinMemory
from tomoskin.twin.emulator.program import BUILD, make_firmware
from tomoskin.twin.emulator.source import front_of

SKIN, SEED = "textile-disc-8", 5
SETTLING = "228 us"
"""With 4 conversions of 12 bits a sample: 404 frames/s."""

PRESSES, PRESSES_SEED = 30, 11
"""Of the reflex."""

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


def run_reflex() -> Iterator[Report]:
    """Milliseconds from a contact on the twin to the command of an arm that draws back."""
    reflex, rows = load_example("reflex"), []
    for name in ("textile-disc-8", "textile-disc-16"):
        progress(name)
        row = reflex.measured(Skin.load(name), PRESSES, PRESSES_SEED)
        promised = {"promised": round(row["one scan, ms"] + 5, 1)}
        rows.append({"skin": name} | {k: round(v, 1) for k, v in row.items()} | promised)
    yield table(
        "a reflex",
        rows,
        "medians; promised: one scan and 5 ms",
        "a touch without doubt is reported in the first frame that shows it, else in the second",
    )


def measured(seconds: float) -> Report:
    """The whole chain for ``seconds`` after the reference."""
    prepared = prepare(Skin.load(SKIN).altered({"readout": {"settling": SETTLING}}))
    progress("tables of the fit")
    prepared.warm_up()
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


def _ran(prepared: Prepared, folder: Path, seconds: float) -> tuple[dict[str, Any], int]:
    """A row, and how many touches there were."""
    calls: list[tuple[int, float, float, int]] = []

    ended = threading.Event()

    def control() -> None:
        while not ended.is_set():
            contacts = live.wait(WAIT)
            now, touches = time.monotonic(), len(contacts.touches)
            if contacts.sequence >= 0 and (not calls or contacts.host_time > calls[-1][1]):
                calls.append((contacts.sequence, contacts.host_time, now, touches))

    file = folder / "chain.mcap"
    with board(prepared.skin, folder) as (port, _):
        runner = Runner(prepared, lambda: SerialTransport(port))
        runner.ask(commands.Record(file))
        runner.start()
        live, loop = LiveSkin(runner), threading.Thread(target=control)
        loop.start()
        with page(runner):
            threading.Event().wait(LEAD)
            began, before = time.process_time(), time.monotonic()
            threading.Event().wait(seconds)
            used = (time.process_time() - began) / (time.monotonic() - before)
            status = runner.status()
        ended.set()
        loop.join()
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


BOARDS, BOARDS_SKIN, BOARDS_SEED, RATE = 8, "textile-disc-16", 11, 100.0
BOARDS_SECONDS, BOARDS_PROMISED = 600.0, 10.0
"""ms from the last byte of a frame to its message, 99 of 100."""

CYCLE = (200, 200, 100, 100)
"""Frames with no, one, two and no presses."""

BOTH = (
    Press(0.02, 0.01, force=4.0, radius=0.012),
    Press(-0.03, 0.01, force=4.0, radius=0.012),
)


def run_boards() -> Iterator[Report]:
    """Eight boards of 16 electrodes in one program, recorded and shown, for ten minutes."""
    yield boards(BOARDS, RATE, BOARDS_SECONDS)


def boards(count: int, rate: float, seconds: float) -> Report:
    """The program with so many boards of ``rate`` frames/s for ``seconds`` after the reference."""
    prepared = prepare(Skin.load(BOARDS_SKIN))
    progress("frames, tables of the fit")
    sent = _frames(prepared.skin, rate)
    prepared.warm_up()
    progress(f"{seconds:.0f} s")
    with (
        tempfile.TemporaryDirectory() as folder,
        _played(prepared.skin, sent, count, rate) as ports,
    ):
        row = _several(prepared, Path(folder) / "boards.mcap", ports, rate, seconds)
    return table(
        f"{count} boards of 16 electrodes in one program",
        [{"frames/s a board": f"{rate:g}"} | row],
        f"frames of the twin on ptys, presses and none, {BOARDS_SKIN}, seed {BOARDS_SEED}; one "
        "recording, one page",
        f"written → message: promised are 99 of 100 within {BOARDS_PROMISED:g} ms",
        f"load of the machine {os.getloadavg()[0]:.0f}",
    )


def _several(
    prepared: Prepared, file: Path, ports: list[tuple[str, Any]], rate: float, seconds: float
) -> dict[str, Any]:
    members = [
        Member(Place(f"skin{k}"), prepared, partial(SerialTransport, port))
        for k, (port, _) in enumerate(ports)
    ]
    ages: list[float] = []

    def take(begun: Any, result: FrameResult) -> None:
        ages.append(time.monotonic() - begun.value - result.sequence / rate)

    with RobotRun(members) as run, contextlib.ExitStack() as stack:
        run.start()
        run.record(file)
        for runner, (_, begun) in zip(run.runners.values(), ports, strict=True):
            stack.enter_context(runner.audience.subscribe("ages", partial(take, begun)))
        stack.enter_context(page(next(iter(run.runners.values()))))
        threading.Event().wait(LEAD)
        first, dropped = len(ages), _dropped(run)
        began, before = time.process_time(), time.monotonic()
        threading.Event().wait(seconds)
        used, took = time.process_time() - began, time.monotonic() - before
        measured, dropped = 1e3 * np.array(ages[first:]), _dropped(run) - dropped
    recorded = lost = 0
    for name in run.runners:
        with SessionReader(file, name) as session:
            numbers = [item.frame.sequence for item in session.frames()]
        recorded += len(numbers)
        lost += numbers[-1] - numbers[0] + 1 - len(numbers)
    return {
        "recorded": recorded,
        "lost": lost,
        "without touches": dropped,
        "written → message: p50, ms": f"{np.median(measured):.2f}",
        "p99": f"{np.percentile(measured, 99):.2f}",
        "longest": f"{measured.max():.1f}",
        "processor a frame, ms": f"{1e3 * used / len(measured):.2f}",
        "of one core": f"{100 * used / took:.0f} %",
    }


def _dropped(run: RobotRun) -> int:
    return sum(state.dropped for state in run.statuses().values())


def _frames(skin: Skin, rate: float) -> list[Frame]:
    """A cycle of frames of the twin, presses and none."""
    rig, frames = Rig(skin, "textile", BOARDS_SEED), list[Frame]()
    identity = Configuration.of(Scan.of(skin.pattern()), ScanSettings.of(skin)).identity
    for presses, count in zip(((), BOTH[:1], BOTH, ()), CYCLE, strict=True):
        rig.board.sheet.set_presses(presses)
        frames += [rig.at((len(frames) + k) / rate) for k in range(count)]
    return [replace(frame, configuration=identity) for frame in frames]


@contextmanager
def _played(
    skin: Skin, frames: list[Frame], count: int, rate: float
) -> Iterator[list[tuple[str, Any]]]:
    """The ports of so many boards that another process plays, and when each began, s."""
    players = [Player(skin, frames, number, rate) for number in range(count)]
    process = multiprocessing.get_context("fork").Process(target=_play, args=(players,))
    process.start()
    try:
        yield [(os.ttyname(player.far), player.begun) for player in players]
    finally:
        process.kill()
        process.join()


class Player:
    """A board behind a pty that sends frames again and again, by a clock."""

    def __init__(self, skin: Skin, frames: list[Frame], number: int, rate: float) -> None:
        self.near, self.far = pty.openpty()
        for end in (self.near, self.far):
            tty.setraw(end)
        os.set_blocking(self.near, False)
        device = {"channels": skin.n_electrodes, "unique_id": f"{number + 1:016x}"}
        self.board = ReplayBoard(skin, device)
        self.begun = multiprocessing.get_context("fork").Value("d", math.inf, lock=False)
        self._frames, self._rate, self._ticks = frames, rate, skin.readout.tick_rate
        self._number, self._phase = 0, number / rate / BOARDS

    @property
    def due(self) -> float:
        """When the next frame is to be sent, s."""
        return float(self.begun.value) + self._number / self._rate

    def send(self) -> None:
        """Send the next frame; where nobody reads it is lost, as with a board."""
        ticks = round(self._number / self._rate * self._ticks)
        frame = self._frames[self._number % len(self._frames)]
        data = encode(replace(frame, sequence=self._number, ticks=ticks))
        self._number += 1
        with contextlib.suppress(BlockingIOError):
            os.write(self.near, data)

    def answer(self) -> None:
        """Answer what is asked; a started board sends its first frame a moment later."""
        was = self.board.scanning
        self.board.obey(os.read(self.near, 4096))
        os.write(self.near, self.board.answer())
        if self.board.scanning and not was:
            self._number = 0
            self.begun.value = time.monotonic() + 0.02 + self._phase
        elif not self.board.scanning:
            self.begun.value = math.inf


def _play(players: list[Player]) -> None:
    by_end = {player.near: player for player in players}
    while True:
        for player in players:
            while player.due <= time.monotonic():
                player.send()
        wait = min(min(player.due for player in players) - time.monotonic(), 0.2)
        for end in select.select(list(by_end), [], [], max(wait, 0))[0]:
            by_end[end].answer()
