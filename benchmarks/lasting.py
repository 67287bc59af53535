"""A press held for an hour on a drifting twin: is it reported all the time, and then gone?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import force as weighing
from report import Report, progress
from tomoskin.board.source import Link, ScanSettings, Transport
from tomoskin.core import Frame, Touch, VirtualClock
from tomoskin.learning import FORCE
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, prepare
from tomoskin.twin import Press, TwinSettings, make_twin

SEEDS = (11,)
"""Nothing here was chosen on them."""

CASES = (("textile-disc-8", "image"), ("textile-disc-8", "fit"), ("textile-disc-16", "fit"))
FORCES = (3.0, 8.0)
HOUR, LEAD, AFTER = 3600.0, 30.0, 60.0
"""Seconds held, before and after."""

SETTLING = "40 ms"
"""For some frames a second: an hour holds enough of them."""

WARMING = 5.0
"""K by which the sheet warms up in the hour, beside its own wandering: 0.38 % of all a kelvin."""

RADIUS, SPREAD = 0.012, 0.05
COLUMNS = (
    *("skin", "method", "N", "seed", "frames", "frames reported, %", "longest gap, s"),
    *("identities", "frames with another touch, %", "error at first, mm", "at the end, mm"),
    *("strength at the end, %", "gone after, s", "N at first", "N at the end"),
)


@dataclass(frozen=True)
class Seen:
    """A frame: seconds since the press, and the touches in it."""

    time: float
    touches: tuple[Touch, ...]


def run(data: Path | None) -> tuple[Report, ...]:
    """Hold every press; ``data`` is not needed."""
    del data
    rows = []
    for skin, method in CASES:
        prepared = prepare(_slow(Skin.load(skin), method))
        for seed in SEEDS:
            weighed = _weighing(prepared, seed) if method == "fit" else prepared
            for force in FORCES:
                progress(f"{skin}, {method}, {force:g} N, seed {seed}")
                place = np.random.default_rng(seed).uniform(-SPREAD, SPREAD, 2)
                held, after = seen(weighed, place, force, seed)
                rows.append((skin, method, force, seed, *judged(held, after, place)))
    return (
        Report(
            f"a press held for {HOUR / 60:.0f} minutes while the sheet warms up by {WARMING:g} K",
            COLUMNS,
            tuple(rows),
            ("preset textile (creep, a wandering temperature, wear), time of the twin; "
             "frames are counted from the onset",
             "forces: medians of the first and of the last minute; calibrated by presses of 2 s"),
        ),
    )  # fmt: skip


def _slow(skin: Skin, method: str) -> Skin:
    return skin.altered({"touch": {"method": method}, "readout": {"settling": SETTLING}})


def _weighing(prepared: Prepared, seed: int) -> Prepared:
    """With a calibration of forces, by short presses of the same tip."""
    scale = weighing.Scale(seed, (RADIUS,), prepared.skin.name)
    model = weighing.calibrated(scale)
    return prepared.calibrated(FORCE.of(model, prepared.pattern, prepared.skin))


def seen(
    prepared: Prepared, place: np.ndarray, force: float, seed: int, hold: float = HOUR
) -> tuple[list[Seen], list[Seen]]:
    """Frames while a press is held, and after it is lifted."""
    clock = VirtualClock()
    twin = make_twin(prepared.skin, TwinSettings.preset("textile", seed), clock)
    press = Press(float(place[0]), float(place[1]), force=force, radius=RADIUS)
    held, after, warmed = [], [], 0.0
    for result in _results(twin, prepared, clock, LEAD + hold + AFTER):
        time = result.host_time - LEAD
        if 0 <= time < hold:
            if not twin.presses:
                twin.set_presses((press,))
            held.append(Seen(time, result.touches))
            due = WARMING * time / hold
            twin.sheet.warm(due - warmed)
            warmed = due
        elif time >= hold:
            if twin.presses:
                twin.set_presses(())
            after.append(Seen(time - hold, result.touches))
    return held, after


def _results(
    twin: Transport, prepared: Prepared, clock: VirtualClock, seconds: float
) -> Iterator[FrameResult]:
    pipeline = Pipeline(prepared)
    settings = ScanSettings.of(prepared.skin)
    with Link(twin, prepared.scan, settings, clock=clock.now) as link:
        while True:
            for item in link.poll(0.5):
                if not isinstance(item, Frame):
                    continue
                if (result := pipeline.push(item)) is None:
                    continue
                if result.host_time > seconds:
                    return
                yield result


def judged(held: Sequence[Seen], after: Sequence[Seen], place: np.ndarray) -> tuple[object, ...]:
    """What stands in a row, from the frames on in which it was first reported."""
    begun = next((n for n, frame in enumerate(held) if frame.touches), len(held))
    frames = held[begun:]
    if not frames:
        return (0, *(None,) * (len(COLUMNS) - 5))
    near = [_nearest(frame, place) for frame in frames]
    times = [frame.time for frame, touch in zip(frames, near, strict=True) if touch is not None]
    gaps = np.diff([*times, held[-1].time])
    beside = np.mean([len(frame.touches) > 1 for frame in frames])
    errors = [np.nan if t is None else 1e3 * _away(t, place) for t in near]
    strength = [np.nan if t is None else abs(t.detection.peak) for t in near]
    forces = [t.detection.force.newtons for t in near if t is not None and t.detection.force]
    few = max(1, len(frames) // 60)
    gone = next((f.time for f in after if not f.touches), None)
    return (
        len(frames),
        f"{100 * np.mean([t is not None for t in near]):.2f}",
        f"{gaps.max():.1f}",
        len({t.id for t in near if t is not None}),
        f"{100 * beside:.2f}",
        f"{np.nanmedian(errors[:few]):.1f}",
        f"{np.nanmedian(errors[-few:]):.1f}",
        f"{100 * np.nanmedian(strength[-few:]) / np.nanmedian(strength[:few]):.0f}",
        "never" if gone is None else f"{gone:.1f}",
        *(f"{np.median(some):.2f}" if some else None for some in (forces[:few], forces[-few:])),
    )


def _nearest(frame: Seen, place: np.ndarray) -> Touch | None:
    return min(frame.touches, key=lambda touch: _away(touch, place), default=None)


def _away(touch: Touch, place: np.ndarray) -> float:
    return float(np.hypot(touch.detection.x - place[0], touch.detection.y - place[1]))
