"""Touch before the scan ends: what drives tell, against frames alone."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np

from bench_rig import INSIDE_90, distance, drawn, evenly, gap, nearest, scan_time
from report import Floats, Report, mm, percent, progress, table
from tomoskin import Skin
from tomoskin.board.source import BOARDS, ScanSettings
from tomoskin.board.wire import Drive
from tomoskin.core import DriveSamples, Frame, Touch
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.twin import Press, ScanClock, TwinSettings, make_electronics, sample_table
from touch_noise import CASES, NEEDED, NoisyBoard, fitted

SEEDS = (9501, 9502)
"""Everything was chosen on seeds 9100 and 9101."""

PRESSES, COURSES, SPEEDS = 15, 4, (0.06, 0.12)
"""Of each seed; m/s."""

DISCS = "textile-disc-8", "textile-disc-16"
RIGS = *product((*DISCS, "textile-square-16"), ["mega"]), *product(DISCS, ["pico"])
PAIR_SEEDS, PAIRS, SOON, APART = (9641, 9642), 10, (0.02, 0.06), 0.05
"""Of pairs, on which nothing was chosen; s and m between their presses."""

TICKS = 250e3
IDLE, HELD, AFTER = 14, 5, 6
"""Turns: untouched, pressed, and after that."""

LATE = 0.15
"""Seconds of a course that do not count."""

UNTOUCHED = 300
NOISES = ("as the skin file says", "hum, 3 times the noise", "drift, 1 % in 300 s, and walk")

Course = Callable[[float], tuple[Press, ...]]
Seen = dict[str, list[tuple[float, tuple[Touch, ...]]]]
"""What "drives" and "frames" have told, and when: s of the rig."""


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
                seen["drives"].append((self.time, self.known if result is None else result.touches))
        head = self.number, round(began * TICKS), self.time, 0, 0, 0
        frame = self.pipeline.push(Frame(*head, np.concatenate(parts)))
        if frame is not None:
            self.known = frame.touches
        if seen is not None:
            seen["frames"].append((self.time, self.known))


def run() -> Iterator[Report]:
    yield table(
        "the first report of a press, and its release",
        [_pressed(*rig) for rig in RIGS],
        f"twin textile, presses of 2 to 6 N that come and go at once, seeds {SEEDS}, {PRESSES} "
        "each; ms from the press until the drive, or the scan, has been read; time on the line "
        "comes on top",
    )
    yield table(
        "a second press while the first is provisional",
        [_paired(*rig) for rig in RIGS[:2]],
        f"two presses as above, {1e3 * SOON[0]:.0f} to {1e3 * SOON[1]:.0f} ms and at least "
        f"{1e3 * APART:.0f} mm apart, which go together; seeds {PAIR_SEEDS}, {PAIRS} pairs each",
    )
    yield table(
        f"an untouched skin, {UNTOUCHED} scans",
        [row for name in DISCS for row in _untouched(name)],
        f"samples as in touch_noise, seed {SEEDS[0]}, at 20 scans/s",
    )
    yield table(
        "a finger that moves",
        [row for name, board in RIGS[:2] for row in _moving(name, board)],
        f"no friction; within 70 mm of the middle; seeds {SEEDS}, {COURSES} courses of a second "
        "each; against where the finger is once the drive, or the scan, has been read; behind: "
        "median, straight on",
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
    times = defaultdict[str, list[float]](list)
    errors, inside, sizes, kept = [], [], [], 0
    for seed in SEEDS:
        progress(f"{name} on {board}, seed {seed}")
        rig, random = _begun(name, board, seed)
        for _ in range(PRESSES):
            press = _drawn(random, _place(random, Skin.load(name)))
            seen, (onset,), release = _watched(rig, random, press)
            for way, shown in seen.items():
                first = (t - onset for t, ts in shown if t > onset and ts)
                times[f"first, {way}"].append(next(first, np.inf))
                last = max([release, *(t for t, ts in shown if ts)])
                gone = (t - release for t, _ in shown if t > last)
                times[f"release, {way}"].append(next(gone, np.inf))
            told = next((ts for t, ts in seen["drives"] if t > onset and ts), ())
            if (touch := nearest(told, press)) is not None:
                errors.append(gap(touch, press))
                inside.append(distance(touch.detection, press.x, press.y) < INSIDE_90)
                sizes.append(np.hypot(touch.detection.sd_x, touch.detection.sd_y))
            kept += len({t.id for _, ts in (*seen["drives"], *seen["frames"]) for t in ts}) == 1
    row: dict[str, Any] = {"skin": name, "board": board, "scan ms": round(1e3 * rig.period, 1)}
    row |= {f"{what}: p50 / p99 ms": _ends(times[what], 99) for what in sorted(times)}
    return row | {
        "first position off, mm": mm(np.median(errors), digits=0)[0],
        "its deviation, mm": mm(np.median(sizes), digits=0)[0],
        "in 90 % ellipse": percent(inside),
        "one identity": percent(kept / (PRESSES * len(SEEDS))),
    }


def _ends(times: Sequence[float], high: float) -> str:
    """The median of ``times`` s, and that percentile, in ms."""
    ends = np.percentile(times, (50, high), method="higher")
    return " / ".join(f"{1e3 * t:.1f}" if np.isfinite(t) else "later" for t in ends)


def _watched(
    rig: DriveRig, random: np.random.Generator, *presses: Press
) -> tuple[Seen, list[float], float]:
    """What is told of presses from nothing on; when each comes, soon after another, and all go."""
    for _ in range(IDLE):
        rig.turn(lambda _: (), ())
    begun = [rig.time + random.uniform() * rig.period]
    begun += [begun[0] + random.uniform(*SOON) for _ in presses[1:]]
    release = begun[-1] + (HELD + random.uniform()) * rig.period

    def course(time: float) -> tuple[Press, ...]:
        return tuple(p for p, t in zip(presses, begun, strict=True) if t <= time < release)

    seen: Seen = {"drives": [], "frames": []}
    for _ in range(len(presses) + HELD + AFTER):
        rig.turn(course, (*begun, release), seen)
    return seen, begun, release


def _paired(name: str, board: str) -> dict[str, Any]:
    """When the second of two presses is told."""
    times = defaultdict[str, list[float]](list)
    for seed in PAIR_SEEDS:
        progress(f"{name} on {board}, pairs of seed {seed}")
        rig, random = _begun(name, board, seed)
        for _ in range(PAIRS):
            pair = drawn(random, 2, apart=APART, forces=(2.0, 6.0))
            seen, (_, second), release = _watched(rig, random, *pair)
            for way, shown in seen.items():
                both = (t - second for t, ts in shown if second < t < release and len(ts) > 1)
                times[f"by {way}: p50 / slowest ms"].append(next(both, np.inf))
    return {"skin": name, "board": board} | {way: _ends(each, 100) for way, each in times.items()}


def _untouched(name: str) -> Iterator[dict[str, Any]]:
    prepared = fitted(name)
    for case in NOISES:
        progress(f"{name}, {case}")
        pipeline = Pipeline(prepared, reference_frames=NEEDED)
        board = NoisyBoard(prepared, CASES[case], SEEDS[0])
        drives, told, before = prepared.scan.sample_drive, 0, False
        for frame in board.frames(NEEDED + UNTOUCHED):
            for drive in range(len(prepared.scan.drives)):
                head = frame.sequence, frame.ticks, frame.host_time, 1, 0, 0, 0, drive, drive
                part = DriveSamples(*head, frame.samples[drives == drive])
                result = pipeline.push_drive(part)
                now = result is not None and bool(result.touches)
                told, before = told + (now and not before), now
            pipeline.push(frame)
        minutes = UNTOUCHED * scan_time(prepared) / 60
        yield {"skin": name, "noise": case, "drives": UNTOUCHED * len(prepared.scan.drives),
               "false touches": told, "minutes of a Mega": round(minutes, 1)}  # fmt: skip


def _moving(name: str, board: str) -> Iterator[dict[str, Any]]:
    for speed in SPEEDS:
        offs: dict[str, list[tuple[float, float, bool]]] = {"drives": [], "frames": []}
        for seed in SEEDS:
            progress(f"{name}, {1e3 * speed:.0f} mm/s, seed {seed}")
            rig, random = _begun(name, board, seed)
            for _ in range(COURSES):
                _course(rig, random, speed, offs)
        for way, rows in offs.items():
            every = np.array(rows)
            off, behind, inside = every[np.isfinite(every[:, 0])].T
            yield {
                "skin": name,
                "mm/s": f"{1e3 * speed:.0f}",
                "by": way,
                "told": percent(len(off) / len(every)),
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

    seen: Seen = {"drives": [], "frames": []}
    arrived = onset + length / speed
    while rig.time < arrived:
        rig.turn(course, (onset,), seen)
    heading = (end - begin) / length
    for way, shown in seen.items():
        for time, touches in shown:
            if not onset + LATE < time < arrived:
                continue
            touch = nearest(touches, at(time))
            if touch is None:
                offs[way].append((np.nan, np.nan, False))
                continue
            d, true = touch.detection, at(time)
            off = np.array([d.x, d.y]) - true
            held = distance(d, *true.tolist()) < INSIDE_90
            offs[way].append((float(np.hypot(*off)), -float(off @ heading), held))
    for _ in range(AFTER):
        rig.turn(lambda _: (), (), None)
