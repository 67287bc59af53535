"""Eight skins in one program: is every touch on time, whatever another board does?"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from report import Report, progress
from tomoskin.board.source import Configuration, ScanSettings, Transport
from tomoskin.board.wire import Decoder, encode
from tomoskin.core import FloatArray, Frame, SourceError
from tomoskin.files.session.replay_board import ReplayBoard
from tomoskin.model.robot import Place
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.run import Member, RobotRun
from tomoskin.run.sinks import ContactListener, Contacts, Stream
from tomoskin.twin import Press, TwinSettings
from tomoskin.twin.scanning import table_of
from tomoskin.twin.source import make_electronics

SKIN, SKINS, SEED = "textile-disc-16", 8, 11
RATE, PROMISED = 100.0, 5.0
"""Frames/s of each board, and ms from bytes to touches, 99 of 100."""

RATES = (10.0, 20.0, 30.0, 40.0, 50.0, 75.0, 100.0)
LIVE_RATE = 25.0
SECONDS, LEAD = 12.0, 6.0
"""Of a live run, and of these those that do not count: references are taken."""

CYCLE = (200, 200, 100, 100)
"""Frames with no, one, two and no presses."""

PRESSES = (
    Press(0.02, 0.01, force=4.0, radius=0.012),
    Press(-0.03, 0.01, force=4.0, radius=0.012),
)
COLUMNS = (
    *("frames/s a board", "of one core, %", "median, ms", "99 of 100, ms"),
    *("beside a flooding one: median", "99 of 100", "promised"),
)
COSTS = ("presses", "median", "mean", "99 of 100", "of it decoding and contacts")
LIVE = (
    "boards",
    "frames/s a board",
    "of one core, %",
    "median, ms",
    "99 of 100, ms",
    "left out, %",
)


def run(data: Path | None) -> tuple[Report, ...]:
    """Cost by processor time, then live runs; ``data`` is not needed."""
    del data
    prepared = prepare(Skin.load(SKIN))
    prepared.warm_up()
    frames = frames_of(prepared)
    progress("processor time")
    parts = processor_times(prepared, frames)
    costs = parts.sum(axis=1)
    rows = tuple((f"{rate:g}", *queued(costs, rate), f"{PROMISED:g}") for rate in RATES)
    alone = Report(
        f"{SKINS} skins of 16 electrodes on one core that does nothing else", COLUMNS, rows,
        ("from a frame's bytes to its contacts: processor times of the frames as they were "
         "measured, and the wait for the frames of the others in a queue",),
    )  # fmt: skip
    return _costs(parts), alone, _live(prepared, frames)


def _costs(parts: FloatArray) -> Report:
    """What a frame costs with none, one and two presses, and what of it is not the pipeline."""
    ends = np.cumsum(CYCLE)
    spans = zip(("none", "one", "two", "none again"), ends - CYCLE, ends, strict=True)
    rows = []
    for presses, first, last in spans:
        whole = 1e3 * parts[first:last].sum(axis=1)
        around = 1e3 * (parts[first:last, 0] + parts[first:last, 2])
        figures = (np.median(whole), whole.mean(), np.percentile(whole, 99), np.median(around))
        rows.append((presses, *(f"{figure:.2f}" for figure in figures)))
    return Report("processor time of a frame, ms", COSTS, tuple(rows))


def frames_of(prepared: Prepared) -> list[Frame]:
    """A cycle of frames of the twin, presses and none."""
    electronics = make_electronics(prepared.skin, TwinSettings.preset("textile", SEED))
    settings = ScanSettings.of(prepared.skin)
    table = table_of(prepared.scan, settings)
    identity = Configuration.of(prepared.scan, settings).identity
    frames: list[Frame] = []
    for presses, count in zip(((), PRESSES[:1], PRESSES, ()), CYCLE, strict=True):
        electronics.sheet.set_presses(presses)
        for _ in range(count):
            number = len(frames)
            ticks = round(number / RATE * prepared.skin.readout.tick_rate)
            samples = electronics.sample(table, number / RATE)
            frames.append(Frame(number, ticks, number / RATE, identity, 0, 0, samples))
    return frames


def processor_times(prepared: Prepared, frames: Sequence[Frame]) -> FloatArray:
    """(n, 3) s for each frame to be decoded, to become touches, and these contacts.

    In a second cycle, when the sheet and the alpha are found.
    """
    pipeline, decoder, times = Pipeline(prepared), Decoder(), []
    stream = Stream.of(prepared, "skin", 0.0, Place("skin"))
    for number in range(2 * len(frames)):
        ticks = round(number / RATE * prepared.skin.readout.tick_rate)
        data = encode(replace(frames[number % len(frames)], sequence=number, ticks=ticks))
        marks = [time.thread_time()]
        (frame,) = decoder.feed(data, number / RATE)
        assert isinstance(frame, Frame)
        marks.append(time.thread_time())
        result = pipeline.push(frame)
        marks.append(time.thread_time())
        if result is not None:
            _ = Contacts.of(stream, result).touches
        marks.append(time.thread_time())
        times.append(np.diff(marks))
    return np.array(times[len(frames) :])


def queued(costs: FloatArray, rate: float, seconds: float = 60.0) -> tuple[str, ...]:
    """Load, and percentiles of the ages alone and beside a board that floods."""
    random = np.random.default_rng(SEED)
    beats = np.arange(int(seconds * rate)) / rate
    arrivals = np.sort(np.concatenate([beats + random.random() / rate for _ in range(SKINS)]))
    work = random.choice(costs, len(arrivals))
    load = SKINS * rate * float(costs.mean())
    if load >= 1:
        return (f"{100 * load:.0f}", *("falls behind",) * 4)
    alone = ages_of(arrivals, work)
    flooded = ages_of(arrivals, work, random.choice(costs, int(seconds / costs.min())))
    percentiles = 1e3 * np.concatenate([np.percentile(a, (50, 99)) for a in (alone, flooded)])
    return (f"{100 * load:.0f}", *(f"{p:.1f}" for p in percentiles))


def ages_of(arrivals: FloatArray, work: FloatArray, flood: FloatArray | None = None) -> FloatArray:
    """(n,) s from each frame's arrival to the end of its ``work``, in turns (Lindley 1952).

    ``flood``: frames of one more board, which asks for a turn as soon as it has had one.
    """
    ages, free, asked, count = np.empty(len(arrivals)), 0.0, 0.0, 0
    for k, (came, takes) in enumerate(zip(arrivals, work, strict=True)):
        while flood is not None and asked <= came:
            free = asked = max(free, asked) + flood[count]
            count += 1
        free = max(free, came) + takes
        ages[k] = free - came
    return ages


class Paced:
    """A board that sends frames at a rate, without the cost of a twin; 0: as fast as it is read."""

    def __init__(self, skin: Skin, frames: Sequence[Frame], rate: float, phase: float) -> None:
        self.name, self._rate = "board", rate
        self._board = ReplayBoard(skin, {})
        self._sent = [encode(f) for f in frames]
        self._frames, self._phase = frames, phase
        self._number, self._begun = 0, 0.0
        self._news = threading.Event()

    def read(self, timeout: float) -> bytes:
        """Answers, else the frames that are due."""
        if answer := self._board.answer():
            return answer
        if not self._board.scanning:
            self._news.wait(timeout)
            self._news.clear()
            return self._board.answer()
        if not self._begun:
            self._begun = time.monotonic() + self._phase
        wait = 0.0 if not self._rate else self._begun + self._number / self._rate - time.monotonic()
        if wait > 0:
            self._news.wait(min(wait, timeout))
        if wait > timeout:
            return b""
        frame = self._frames[self._number % len(self._frames)]
        ticks = round(self._number / (self._rate or 1000) * 250_000)
        self._number += 1
        return encode(replace(frame, sequence=self._number, ticks=ticks))

    def write(self, data: bytes) -> None:
        """Commands."""
        self._board.obey(data)
        self._news.set()

    def close(self) -> None:
        """Nothing is held."""


class Silent:
    """A port behind which nobody answers."""

    name = "silent"

    def read(self, timeout: float) -> bytes:
        """Nothing."""
        threading.Event().wait(timeout)
        return b""

    def write(self, data: bytes) -> None:
        """It is heard by nobody."""

    def close(self) -> None:
        """Nothing is held."""


@dataclass
class Ages:
    """When each frame's contacts were there, s after its last byte."""

    since: float
    values: list[float]
    sequences: list[int]

    def take(self, contacts: object) -> None:
        """Called with the contacts of each frame."""
        host_time, latency = contacts.host_time, contacts.latency  # type: ignore[attr-defined]
        if host_time > self.since:
            self.values.append(latency)
            self.sequences.append(contacts.sequence)  # type: ignore[attr-defined]


def _missing() -> Transport:
    raise SourceError("there is no such port")


def _live(prepared: Prepared, frames: Sequence[Frame]) -> Report:
    load = f"{os.getloadavg()[0]:.0f}"
    rows = []
    for others in ("none", "a dead and a missing one", "a flooding one"):
        progress(f"live, beside {SKINS}: {others}")
        found = _ran(prepared, frames, others, LIVE_RATE)
        rows.append((f"{SKINS}, beside: {others}", f"{LIVE_RATE:g}", *found))
    return Report(
        "the same live, by the clock", LIVE, tuple(rows),
        (f"to the call of a function of the same program; {SECONDS - LEAD:.0f} s each, begun at a "
         f"load of the machine of {load} beside this: times are right on an idle one only",),
    )  # fmt: skip


def _ran(prepared: Prepared, frames: Sequence[Frame], others: str, rate: float) -> tuple[str, ...]:
    ages = {f"skin_{k}": Ages(time.monotonic() + LEAD, [], []) for k in range(SKINS)}
    members = [
        Member(
            Place(name),
            prepared,
            lambda k=k: Paced(prepared.skin, frames, rate, k / SKINS / rate),
            [ContactListener(seen.take)],
        )
        for k, (name, seen) in enumerate(ages.items())
    ]
    if others.startswith("a dead"):
        members += [
            Member(Place("dead"), prepared, Silent),
            Member(Place("gone"), prepared, _missing),
        ]
    elif others.startswith("a flooding"):
        flood = Paced(prepared.skin, frames, 0.0, 0.0)
        members.append(Member(Place("flood"), prepared, lambda: flood))
    run, begun = RobotRun(members), time.process_time()
    run.start()
    threading.Event().wait(SECONDS)
    used = (time.process_time() - begun) / SECONDS
    run.stop()
    values = 1e3 * np.concatenate([seen.values for seen in ages.values()])
    steps = [b - a for seen in ages.values() for a, b in pairwise(seen.sequences)]
    lost = 1 - len(steps) / sum(steps)
    p50, p99 = np.percentile(values, (50, 99))
    return f"{100 * used:.0f}", f"{p50:.1f}", f"{p99:.1f}", f"{100 * lost:.2f}"
