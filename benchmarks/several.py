"""Eight skins in one program: what a frame costs, and whether every touch is on time."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from report import Report, progress, table
from rig import Rig
from tomoskin.board.wire import Decoder, encode
from tomoskin.core import FloatArray, Frame
from tomoskin.model.robot import Place
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.run.sinks import Moment, Stream, contacts_of
from tomoskin.twin import Press

SKIN, SKINS, SEED = "textile-disc-16", 8, 11
RATE, PROMISED = 100.0, 5.0
"""Frames/s of each board, and ms from bytes to touches, 99 of 100."""

RATES = (10.0, 20.0, 30.0, 40.0, 50.0, 75.0, 100.0)
CYCLE = (200, 200, 100, 100)
"""Frames with no, one, two and no presses."""

PRESSES = (
    Press(0.02, 0.01, force=4.0, radius=0.012),
    Press(-0.03, 0.01, force=4.0, radius=0.012),
)


def run() -> Iterator[Report]:
    prepared = prepare(Skin.load(SKIN))
    prepared.warm_up()
    progress("processor time")
    parts = processor_times(prepared, frames_of(prepared))
    costs = parts.sum(axis=1)
    yield table("processor time of a frame, ms", _costs(parts))
    yield table(
        f"{SKINS} skins of 16 electrodes on one core that does nothing else",
        ({"frames/s a board": f"{rate:g}"} | queued(costs, rate) for rate in RATES),
        "from a frame's bytes to its contacts: processor times of the frames as they were "
        f"measured, and the wait for the frames of the others in a queue; promised: {PROMISED} "
        "ms",
    )


def _costs(parts: FloatArray) -> Iterator[dict[str, Any]]:
    """What a frame costs with none, one and two presses, and what of it is not the pipeline."""
    ends = np.cumsum(CYCLE)
    spans = zip(("none", "one", "two", "none again"), ends - CYCLE, ends, strict=True)
    for presses, first, last in spans:
        whole = 1e3 * parts[first:last].sum(axis=1)
        around = 1e3 * (parts[first:last, 0] + parts[first:last, 2])
        yield {
            "presses": presses,
            "median": f"{np.median(whole):.2f}",
            "mean": f"{whole.mean():.2f}",
            "99 of 100": f"{np.percentile(whole, 99):.2f}",
            "of it decoding and contacts": f"{np.median(around):.2f}",
        }


def frames_of(prepared: Prepared) -> list[Frame]:
    """A cycle of frames of the twin, presses and none."""
    rig, frames = Rig(prepared.skin, "textile", SEED), list[Frame]()
    for presses, count in zip(((), PRESSES[:1], PRESSES, ()), CYCLE, strict=True):
        rig.board.sheet.set_presses(presses)
        frames += [rig.at((len(frames) + k) / RATE) for k in range(count)]
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
            contacts_of(stream, Moment.of(result, with_image=False))
        marks.append(time.thread_time())
        times.append(np.diff(marks))
    return np.array(times[len(frames) :])


def queued(costs: FloatArray, rate: float, seconds: float = 60.0) -> dict[str, str]:
    """Load, and percentiles of the ages alone and beside a board that floods."""
    random = np.random.default_rng(SEED)
    beats = np.arange(int(seconds * rate)) / rate
    arrivals = np.sort(np.concatenate([beats + random.random() / rate for _ in range(SKINS)]))
    work = random.choice(costs, len(arrivals))
    load = SKINS * rate * float(costs.mean())
    row = {"of one core, %": f"{100 * load:.0f}"}
    if load >= 1:
        return row
    flood = random.choice(costs, int(seconds / costs.min()))
    for name, other in (("", None), ("beside a flooding one: ", flood)):
        median, p99 = 1e3 * np.percentile(ages_of(arrivals, work, other), (50, 99))
        row |= {f"{name}median, ms": f"{median:.1f}", f"{name}99 of 100, ms": f"{p99:.1f}"}
    return row


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
