"""Touch before the scan ends: what drives tell, against frames alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bench_rig import INSIDE_90, distance, evenly, gap, nearest
from locator import Set
from report import Floats, Report, available, mm, percent, progress, table
from tomoskin import Skin
from tomoskin.board.source import BOARDS, ScanSettings
from tomoskin.board.wire import Drive
from tomoskin.core import Detection, DriveSamples, Frame, Touch
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.sensing.fit import telling_order
from tomoskin.twin import Press, ScanClock, TwinSettings, make_electronics, sample_table
from touch_lab import TwinLab
from touch_noise import CASES, NEEDED, NoisyBoard, fitted

SEEDS = (9201, 9202)
"""Everything was chosen on seed 9100."""

PRESSES, COURSES, SPEEDS = 15, 4, (0.06, 0.12)
"""Of each seed; m/s."""

RIGS = (
    ("textile-disc-8", "mega"),
    ("textile-disc-16", "mega"),
    ("textile-square-16", "mega"),
    ("textile-disc-8", "pico"),
    ("textile-disc-16", "pico"),
)
TICKS = 250e3
IDLE, HELD, AFTER = 14, 5, 6
"""Turns: untouched, pressed, and after that."""

LATE = 0.15
"""Seconds of a course that do not count."""

UNTOUCHED = 300
NOISES = ("as the skin file says", "hum, 3 times the noise", "drift, 1 % in 300 s, and walk")
PART = 0.4
"""Of the drives that are read."""

CHOSEN_ON = "parallel and round16_single550"
"""Recordings on which the choice was tried."""

RECORDINGS = (
    "eskin_hydrogel_round/round16_single500_ohmc",
    "eskin_varsens16/noPattern",
    "eskin_varsens16/fullCB",
    "eskin_varsens16/concentric",
)
LEARNT, TESTED = 300, 60

Course = Callable[[float], tuple[Press, ...]]


class DriveRig:
    """A twin that is read drive by drive by the clock of a board; a press shows in a sample that is
    read after it."""

    def __init__(self, prepared: Prepared, board: str, seed: int) -> None:
        record, skin, self.scan = BOARDS[board], prepared.skin, prepared.scan
        given = ScanSettings.of(skin)
        settings = given.on_board(record.adc_bits)
        assert settings is not None
        conversion = record.converter.conversion(given.prescaler)
        clock = ScanClock(
            given.dead_time, given.settling, conversion, dropped=record.converter.dropped
        )
        pairs = zip(self.scan.drives.tolist(), self.scan.masks.tolist(), strict=True)
        self.tables = [
            sample_table([Drive(source, sink, mask)], settings.oversampling, clock)
            for (source, sink), mask in pairs
        ]
        twin = TwinSettings.preset("textile", seed)
        self.board = make_electronics(skin, twin, record.adc_bits)
        self.pipeline, self.time, self.number = Pipeline(prepared), 0.0, 0
        self.pipeline.tick_rate = TICKS
        self.known: tuple[Touch, ...] = ()
        self.period = sum(each.seconds for each in self.tables)

    def drive(self, number: int, course: Course, steps: Sequence[float]) -> Any:
        """(n,) samples of a drive while presses go their ``course``, which jumps at ``steps`` s."""
        own, start = self.tables[number], self.time
        self.time = end = start + own.seconds
        step = next((time for time in steps if start < time < end), None)
        self.board.sheet.set_presses(
            course(start + float(own.middles[0]) if step is None else start)
        )
        counts = self.board.sample(own, start)
        if step is not None:
            self.board.sheet.set_presses(course(end))
            counts = np.where(start + own.time < step, counts, self.board.sample(own, step))
        return counts

    def turn(self, course: Course, steps: Sequence[float], seen: Seen | None = None) -> None:
        """A turn through all drives: each is pushed, and then the frame."""
        began, parts = self.time, []
        self.number += 1
        for drive in range(len(self.tables)):
            start = self.time
            counts = self.drive(drive, course, steps)
            parts.append(counts)
            head = self.number, round(start * TICKS), self.time, 0, 0, 0
            result = self.pipeline.push_drive(DriveSamples(*head, 0, drive, drive, counts))
            if seen is not None:
                seen.drives.append((self.time, self.known if result is None else result.touches))
        head = self.number, round(began * TICKS), self.time, 0, 0, 0
        frame = self.pipeline.push(Frame(*head, np.concatenate(parts)))
        if frame is not None:
            self.known = frame.touches
        if seen is not None:
            seen.frames.append((self.time, self.known))


Shown = list[tuple[float, tuple[Touch, ...]]]


@dataclass
class Seen:
    """What drives and frames have told, and when: s of the rig."""

    drives: Shown = field(default_factory=list)
    frames: Shown = field(default_factory=list)


def run(data: Path | None) -> Iterator[Report]:
    """Drives against frames; the last table needs the public recordings."""
    yield table(
        "the first report of a press, and its release",
        [_pressed(*rig) for rig in RIGS],
        f"twin textile, presses of 2 to 6 N that come and go at once, seeds {SEEDS}, {PRESSES} "
        "each; ms from the press until the drive, or the scan, has been read; time on the line "
        "comes on top",
    )
    yield table(
        f"an untouched skin, {UNTOUCHED} scans",
        [row for name in ("textile-disc-8", "textile-disc-16") for row in _untouched(name)],
        f"samples as in touch_noise, seed {SEEDS[0]}, at 20 scans/s",
    )
    yield table(
        "a finger that moves",
        [row for name, board in RIGS[:2] for row in _moving(name, board)],
        f"no friction; within 70 mm of the middle; seeds {SEEDS}, {COURSES} courses of a second "
        "each; against where the finger is once the drive, or the scan, has been read; behind: "
        "median, straight on",
    )
    yield table(
        f"a touch that stands, from {percent(PART)} of the drives that tell most of it",
        [_standing(name) for name in ("8", "16", "square 16")],
        f"twin textile, seeds {SEEDS}, {PRESSES} presses each, one frame at a time",
    )
    if available(data, "eskin_varsens16") is not None:
        folder = available(data)
        assert folder is not None
        yield table(
            f"calibrated positions from {percent(PART)} of the measurements",
            [_masked(folder, name) for name in RECORDINGS],
            f"public recordings, {LEARNT} presses learnt and {TESTED} others tested; drives "
            "chosen where the touch was, as whole drives too; what chooses was tried on "
            f"{CHOSEN_ON}; mean errors, mm",
        )


def _place(random: np.random.Generator, skin: Skin) -> Floats:
    """Evenly over the inner 85 % of a disc, or of a square."""
    half = 0.85 * np.ptp(skin.outline.polyline(skin.outline.length / 200), axis=0)[0] / 2
    if "square" in skin.name:
        return np.asarray(random.uniform(-half, half, 2))
    return evenly(random, 1, half)[0]


def _drawn(random: np.random.Generator, at: Floats) -> Press:
    force, radius = random.uniform(2, 6), random.choice([8e-3, 10e-3, 12e-3, 15e-3])
    return Press(float(at[0]), float(at[1]), float(force), float(radius))


def _begun(name: str, board: str, seed: int) -> tuple[DriveRig, np.random.Generator]:
    rig = DriveRig(prepare(Skin.load(name)), board, seed)
    for _ in range(60):
        rig.turn(lambda _: (), ())
    return rig, np.random.default_rng(seed)


def _pressed(name: str, board: str) -> dict[str, Any]:
    first: dict[str, list[float]] = {"drives": [], "frames": []}
    gone: dict[str, list[float]] = {"drives": [], "frames": []}
    errors, inside, sizes, kept = [], [], [], 0
    for seed in SEEDS:
        progress(f"{name} on {board}, seed {seed}")
        rig, random = _begun(name, board, seed)
        for _ in range(PRESSES):
            press = _drawn(random, _place(random, Skin.load(name)))
            seen, onset, release = _watched(rig, random, press)
            for way, shown in (("drives", seen.drives), ("frames", seen.frames)):
                first[way].append(next((t - onset for t, ts in shown if t > onset and ts), np.inf))
                after = [(t, ts) for t, ts in shown if t > release]
                last = max([k for k, (_, ts) in enumerate(after) if ts], default=-1) + 1
                gone[way].append(after[last][0] - release if last < len(after) else np.inf)
            told = next((ts for t, ts in seen.drives if t > onset and ts), ())
            if (touch := nearest(told, press)) is not None:
                errors.append(gap(touch, press))
                inside.append(distance(touch.detection, press.x, press.y) < INSIDE_90)
                sizes.append(np.hypot(touch.detection.sd_x, touch.detection.sd_y))
            kept += len({t.id for _, ts in (*seen.drives, *seen.frames) for t in ts}) == 1
    row: dict[str, Any] = {"skin": name, "board": board, "scan ms": round(1e3 * rig.period, 1)}
    for title, ways in (("first", first), ("release", gone)):
        for way, times in ways.items():
            ends = np.percentile(times, (50, 99), method="higher")
            told = (f"{1e3 * t:.1f}" if np.isfinite(t) else "later" for t in ends)
            row[f"{title}, {way}: p50 / p99 ms"] = " / ".join(told)
    return row | {
        "first position off, mm": mm(np.median(errors), digits=0)[0],
        "its deviation, mm": mm(np.median(sizes), digits=0)[0],
        "in 90 % ellipse": percent(inside),
        "one identity": percent(kept / (PRESSES * len(SEEDS))),
    }


def _watched(rig: DriveRig, random: np.random.Generator, press: Press) -> tuple[Seen, float, float]:
    """What is told of a press from nothing on, and when it comes and goes."""
    for _ in range(IDLE):
        rig.turn(lambda _: (), ())
    onset = rig.time + random.uniform() * rig.period
    release = onset + (HELD + random.uniform()) * rig.period
    seen = Seen()
    for _ in range(1 + HELD + AFTER):
        rig.turn(lambda t: (press,) if onset <= t < release else (), (onset, release), seen)
    return seen, onset, release


def _untouched(name: str) -> Iterator[dict[str, Any]]:
    prepared = fitted(name)
    for case in NOISES:
        progress(f"{name}, {case}")
        pipeline = Pipeline(prepared, reference_frames=NEEDED)
        board = NoisyBoard(prepared, CASES[case], SEEDS[0])
        drives, told = prepared.scan.sample_drive, 0
        before = False
        for frame in board.frames(NEEDED + UNTOUCHED):
            for drive in range(len(prepared.scan.drives)):
                head = frame.sequence, frame.ticks, frame.host_time, 1, 0, 0, 0, drive, drive
                part = DriveSamples(*head, frame.samples[drives == drive])
                result = pipeline.push_drive(part)
                now = result is not None and bool(result.touches)
                told, before = told + (now and not before), now
            pipeline.push(frame)
        hours = UNTOUCHED * BOARD_PERIOD[name] / 3600
        yield {"skin": name, "noise": case, "drives": UNTOUCHED * len(prepared.scan.drives),
               "false touches": told, "minutes of a Mega": round(60 * hours, 1)}  # fmt: skip


BOARD_PERIOD = {"textile-disc-8": 0.056, "textile-disc-16": 0.0965}
"""Seconds of a Mega's scan."""


def _moving(name: str, board: str) -> Iterator[dict[str, Any]]:
    for speed in SPEEDS:
        offs: dict[str, list[tuple[float, float, bool]]] = {"drives": [], "frames": []}
        for seed in SEEDS:
            progress(f"{name}, {1e3 * speed:.0f} mm/s, seed {seed}")
            rig, random = _begun(name, board, seed)
            for _ in range(COURSES):
                _course(rig, random, speed, offs)
        for way, rows in offs.items():
            off, behind, inside = np.array(rows).T
            yield {
                "skin": name,
                "mm/s": f"{1e3 * speed:.0f}",
                "by": way,
                "off, mm": mm(np.median(off), digits=1)[0],
                "p90 mm": mm(np.percentile(off, 90), digits=1)[0],
                "behind, mm": mm(np.nanmedian(behind), digits=1)[0],
                "in 90 % ellipse": percent(inside),
            }


def _course(
    rig: DriveRig,
    random: np.random.Generator,
    speed: float,
    offs: dict[str, list[tuple[float, float, bool]]],
) -> None:
    """A finger goes to and fro between two places for a second."""
    for _ in range(IDLE):
        rig.turn(lambda _: (), ())
    begin = end = np.zeros(2)
    while np.hypot(*(end - begin)) < 0.06:
        begin, end = evenly(random, 2, 0.07)
    press, onset = _drawn(random, begin), rig.time + 0.01
    length = float(np.hypot(*(end - begin)))

    def at(time: float) -> Floats:
        way = max(time - onset, 0.0) * speed / length
        return np.asarray(begin + (end - begin) * min(way, 1.0))

    def course(time: float) -> tuple[Press, ...]:
        x, y = at(time).tolist()
        return (Press(x, y, press.force, press.radius),) if time >= onset else ()

    seen = Seen()
    arrived = onset + length / speed
    while rig.time < arrived:
        rig.turn(course, (onset,), seen)
    heading = (end - begin) / length
    for way, shown in (("drives", seen.drives), ("frames", seen.frames)):
        for time, touches in shown:
            touch = nearest(touches, at(time))
            if touch is None or not onset + LATE < time < arrived:
                continue
            d, true = touch.detection, at(time)
            off = np.array([d.x, d.y]) - true
            held = distance(d, *true.tolist()) < INSIDE_90
            offs[way].append((float(np.hypot(*off)), -float(off @ heading), held))
    for _ in range(AFTER):
        rig.turn(lambda _: (), (), None)


def _standing(name: str) -> dict[str, Any]:
    whole, part, evenly_ = [], [], []
    for seed in SEEDS:
        progress(f"standing on {name}, seed {seed}")
        lab, random = TwinLab(name, "textile", seed), np.random.default_rng(seed)
        index = lab.prepared.pattern.drive_index
        count = int(PART * (index.max() + 1))
        for _ in range(PRESSES):
            press = _drawn(random, _place(random, lab.skin))
            dv = lab.volts((press,)) - lab.reference.mean
            found = lab.by_fit().push(lab.shown(dv))
            if not found:
                continue
            order = _telling(lab, found[0], count)
            spread = np.linspace(0, index.max() + 1, count, endpoint=False).astype(int)
            for errors, drives in ((part, order), (evenly_, spread.tolist())):
                again = _fitted_from(lab, dv, np.isin(index, drives))
                errors.append(gap(again, press) if again else np.nan)
            whole.append(gap(found[0], press))
    return {
        "sheet": name,
        "drives": f"{count} of {index.max() + 1}",
        "all: rms mm": mm(np.sqrt(np.mean(np.square(whole))))[0],
        "chosen: rms mm": mm(np.sqrt(np.nanmean(np.square(part))))[0],
        "ratio": round(float(np.sqrt(np.nanmean(np.square(part)) / np.mean(np.square(whole)))), 2),
        "spread evenly: rms mm": mm(np.sqrt(np.nanmean(np.square(evenly_))))[0],
        "not found": int(np.isnan(part).sum()),
    }


def _telling(lab: TwinLab, found: Detection, count: int) -> list[int]:
    """The drives that tell most of a touch."""
    model, index = lab.prepared.spots, lab.prepared.pattern.drive_index
    assert model is not None
    radius = np.sqrt(found.area / np.pi)
    content = np.log1p(max(found.peak / lab.skin.conductivity, -0.99)) * radius**2 * 4.0
    spot = np.array([[found.x, found.y, np.log(radius), content]])
    parts = model.solver.expanded(spot)[0] @ model.solver.table.basis
    noise = np.sqrt(lab.prepared.readout.noise**2 + (0.08 * parts[0]) ** 2)
    unknown = parts[5:] * [[model.prior.directed], [model.prior.reshaped]]
    slopes = np.vstack([parts[1:5], unknown]) / noise
    own = [slopes[:, index == drive] for drive in range(index.max() + 1)]
    information = np.array([each @ each.T for each in own])
    return telling_order(information, np.diag([*model.prior.weights**2, 1.0, 1.0]), count, 6)


def _fitted_from(lab: TwinLab, dv: Floats, read: Any) -> Detection | None:
    """The strongest touch of those measurements that are read."""
    finder = lab.by_fit()
    return finder.strongest(np.where(read, dv, np.nan)) if hasattr(finder, "strongest") else None


def _masked(folder: Path, name: str) -> dict[str, Any]:
    progress(name)
    every = Set.of(folder / f"{name}.npz")
    chosen = np.random.default_rng(SEEDS[0]).permutation(len(every.dv))[: LEARNT + TESTED]
    taught, asked = every.at(chosen[:LEARNT]), every.at(chosen[LEARNT:])
    locator, drives = taught.learnt(), every.pattern.drive_index
    places, _ = locator.predict(asked.dv)
    row: dict[str, Any] = {"recording": name.rsplit("/", maxsplit=1)[-1]}
    whole = np.linalg.norm(places - asked.xy, axis=1).mean()
    row["all mm"] = mm(whole)[0]
    slopes = list(_slopes(taught, places))
    for way, parts in (("measurements", np.arange(len(drives))), ("drives", drives)):
        masked = asked.dv.copy()
        for frame, own in zip(masked, slopes, strict=True):
            frame[~np.isin(parts, _chosen(own, parts))] = np.nan
        error = np.linalg.norm(locator.predict(masked)[0] - asked.xy, axis=1).mean()
        row |= {f"chosen {way} mm": mm(error)[0], f"ratio, {way}": round(float(error / whole), 2)}
    return row


def _chosen(slopes: Floats, parts: Any) -> list[int]:
    """The ``parts`` (n_meas,) of the measurements that tell most of a position."""
    own = [slopes[:, parts == part] for part in range(parts.max() + 1)]
    information = np.array([each @ each.T for each in own])
    return telling_order(information, np.eye(2) / 0.02**2, int(PART * len(own)), 2)


def _slopes(taught: Set, places: Floats) -> Iterator[Floats]:
    """(2, n_meas) of each place: slopes of the measurements by x and y in deviations of what a
    cubic of the position leaves of them."""
    powers = [(i, j) for i in range(4) for j in range(4 - i)]
    unit = float(np.abs(taught.xy).max())
    design = np.stack([np.prod((taught.xy / unit) ** p, axis=1) for p in powers], axis=1)
    changes = np.nan_to_num(taught.dv)
    cubic = np.linalg.lstsq(design, changes, rcond=None)[0]
    noise = (changes - design @ cubic).std(axis=0) + 1e-30
    for x, y in places / unit:
        by_x = [i * x ** max(i - 1, 0) * y**j for i, j in powers]
        by_y = [j * x**i * y ** max(j - 1, 0) for i, j in powers]
        yield np.array([by_x, by_y]) @ cubic / unit / noise
