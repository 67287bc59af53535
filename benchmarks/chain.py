"""From a board of 400 frames/s to touches, page and recording, on one core: a minute."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from report import Report, progress
from served import served
from tomoskin.board.source import SerialTransport
from tomoskin.core import FloatArray
from tomoskin.files.session import SessionReader
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.run import Runner, commands
from tomoskin.run.sinks import ContactListener, Contacts
from tomoskin.twin import Press, TwinSettings, TwinSkin
from tomoskin.twin.emulator import SkinMemory
from tomoskin.twin.emulator.program import BUILD, make_firmware
from tomoskin.twin.emulator.source import front_of

SKIN, SEED = "textile-disc-8", 5
SETTLING = "228 us"
"""With 4 conversions of 12 bits a sample: 404 frames/s."""

SECONDS = 60.0
LEAD = 10.0
"""Seconds in which the reference is taken; what the first frames cost does not count as latency."""

STEPS, STEP = 60, 0.1
"""Places of the presses, and s at each: one press, two, none, twenty steps each."""

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


@dataclass
class Seen:
    """Sequence number, host time and time of call of each frame's contacts."""

    rows: list[tuple[int, float, float]] = field(default_factory=list)
    touches: int = 0

    def take(self, contacts: Contacts) -> None:
        """Called with the contacts of each frame."""
        self.rows.append((contacts.sequence, contacts.host_time, time.monotonic()))
        self.touches += len(contacts.touches)


def run(data: Path | None) -> tuple[Report, ...]:
    """A minute; ``data`` is not needed."""
    del data
    return (measured(SECONDS),)


def measured(seconds: float) -> Report:
    """The whole chain for ``seconds`` after the reference."""
    skin = Skin.load(SKIN).altered({"readout": {"settling": SETTLING}})
    prepared = prepare(skin)
    progress("tables of the fit")
    prepared.warm_up()
    progress(f"{seconds:.0f} s")
    with tempfile.TemporaryDirectory() as folder:
        return _report(prepared, Path(folder), seconds)


def _report(prepared: Prepared, folder: Path, seconds: float) -> Report:
    seen, file = Seen(), folder / "chain.mcap"
    with board(prepared.skin, folder) as port:
        runner = Runner(prepared, lambda: SerialTransport(port), sinks=[ContactListener(seen.take)])
        runner.ask(commands.Record(file))
        runner.start()
        with page(runner):
            threading.Event().wait(LEAD)
            began, before = time.process_time(), time.monotonic()
            threading.Event().wait(seconds)
            used = (time.process_time() - began) / (time.monotonic() - before)
            status = runner.status()
        runner.stop()
    session = SessionReader(file)
    frames = np.array(
        [(m.frame.sequence, m.frame.host_time, m.frame.ticks) for m in session.frames()]
    )
    ages = _ages(frames, np.array(seen.rows), before, prepared.skin.readout.tick_rate)
    rate = (len(frames) - 1) / (np.ptp(frames[:, 2]) / prepared.skin.readout.tick_rate)
    lost = int(frames[-1, 0] - frames[0, 0]) + 1 - len(frames)
    steady = frames[:, 1] > before
    without = int(steady.sum()) - int((np.array(seen.rows)[:, 1] > before).sum())
    early = len(frames) - len(seen.rows) - without
    row = (
        prepared.pattern.n_electrodes, f"{rate:.0f}", len(frames), lost, status.corrupt,
        early, without, *(f"{1e3 * p:.2f}" for p in ages), f"{PROMISED:g}", f"{100 * used:.0f} %",
    )  # fmt: skip
    columns = (
        *("electrodes", "frames/s", "recorded", "lost", "corrupt"),
        *("without touches: first seconds", "later", "read → touches: p50, ms", "p99", "longest"),
        *("by the board's clock: p50", "p99", "promised", "of one core"),
    )
    return Report(
        f"{seconds:.0f} s of frames to touches, page and recording", columns, (row,),
        (
            "the portable firmware as a process with the timing of a Pico, on a pty; presses that "
            f"go round, one, two and none in turn; {SKIN}, seed {SEED}",
            "read → touches: from a frame's bytes to the call of a function of the same program; "
            "by the board's clock: the way through the pty and all waiting too",
            "of one core: processor time of the program, which also serves a page; the board and "
            "the page's reader run on another",
            f"{seen.touches:,} touches; load of the machine {os.getloadavg()[0]:.0f}",
        ),
    )  # fmt: skip


def _ages(frames: FloatArray, rows: FloatArray, since: float, rate: float) -> tuple[float, ...]:
    """p50, p99 and longest from reading; p50 and p99 from the board's clock, s."""
    rows = rows[rows[:, 1] > since]
    sent = dict(zip(frames[:, 0].astype(int).tolist(), frames[:, 2] / rate, strict=True))
    offset = float((frames[:, 1] - frames[:, 2] / rate)[frames[:, 1] > since].min())
    by_board = rows[:, 2] - offset - np.array([sent[int(number)] for number in rows[:, 0]])
    read = rows[:, 2] - rows[:, 1]
    return (
        *(float(p) for p in np.percentile(read, (50, 99))),
        float(read.max()),
        *(float(p) for p in np.percentile(by_board, (50, 99))),
    )


@contextmanager
def board(skin: Skin, folder: Path) -> Iterator[str]:
    """The port of the host-built board, before a sheet on which presses go round."""
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
        yield port
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


def elsewhere(words: list[str]) -> subprocess.Popen[str]:
    """A process on the cores that this one does not use, where there are any."""
    others = set(range(os.cpu_count() or 1)) - os.sched_getaffinity(0)
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    if others:
        os.sched_setaffinity(process.pid, others)
    return process
