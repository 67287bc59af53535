"""What happens to a deforming sheet in time, and the frames that a board makes of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from bench_rig import scan_time, stage
from deform_plant import HEIGHT, Affine, Ball, Fold, Law, Percolating, Pose, Sheet, strain_of
from report import Floats
from tomoskin import Skin
from tomoskin.core import Frame
from tomoskin.pipeline import Prepared, prepare
from touch_lab import Converter

REST, RAMP, HELD, PRESSED, AFTER = 3.0, (1.0, 2.0), 3.0, 2.5, 3.0
SETTLED, PRESS_RAMP = 0.6, 0.15
"""Seconds of each part; from a part's begin to where its frames count; in which a press comes."""

CREEP, CREEP_TIME, KEPT, YIELD, FORGET = 0.08, 0.5, (0.04, 0.12), 0.3, 4.0
"""Part of a strain that follows by its logarithm of time, s; part of a strain that stays for a
while, of what exceeds ``YIELD`` of its largest; s in which half of it has gone."""

PRESS_KEPT, LOOSE = 0.03, 3.0
"""Part of a press that stays for a while; by how much a loosened contact is worse."""

NODES = (np.cos(np.pi * np.arange(4, -1, -1) / 4) + 1) / 2
"""Parts of a deformation that are solved; between them a polynomial is exact to 1e-5 of a change,
to 5e-3 where electrodes slide over the mesh's nodes."""


STATED = {"material": {"gauge": 2, "gauge_across": 2}, "surface": {"layer": f"{1e3 * HEIGHT:g} mm"}}
"""What a skin file says of :class:`Affine`, and of what bends."""


@cache
def _stated(electrodes: int) -> Prepared:
    return prepare(Skin.load(f"textile-disc-{electrodes}").altered(STATED))


@dataclass(frozen=True)
class Run:
    """What happens to one sheet: its poses, what presses while they stand, and how they go on."""

    kind: str
    electrodes: int
    law: str
    seed: int
    poses: tuple[Pose, ...] = ()
    balls: tuple[Ball, ...] = ()
    early: bool = False
    """Whether it is pressed before and while it is bent."""

    gain: float = 0.0
    slides: bool = False
    """Whether the electrodes stay where they are while the sheet slides under them."""

    loosened: int | None = None
    begins_bent: bool = False
    """Whether the reference is taken while it is bent."""

    @property
    def prepared(self) -> Prepared:
        """Where the law is one that a user can know, the skin file says it."""
        return _stated(self.electrodes) if self.law == "affine" else stage(self.electrodes)

    @property
    def gauges(self) -> Law:
        """The law by its name, drawn by the seed."""
        random = np.random.default_rng([self.seed, 2])
        rate, share = random.uniform(3.0, 6.0), random.uniform(0.6, 0.9)
        return Affine() if self.law == "affine" else Percolating(float(rate), float(share))


@dataclass(frozen=True)
class Course:
    """When what happens, s, and how far: parts with their ends, by name."""

    ends: dict[str, float]
    first: float
    """Part of the deformation at the beginning."""

    @classmethod
    def of(cls, run: Run, random: np.random.Generator) -> Course:
        """In order; what presses does so in the parts that say so."""
        down, up = random.uniform(*RAMP, 2)
        if not run.poses:
            lengths = {"rest": REST, "pressed" if run.balls else "held": PRESSED}
        elif run.begins_bent:
            lengths = {"rest": REST, "straightening": up, "after": AFTER}
        elif not run.balls:
            lengths = {"rest": REST, "bending": down, "held": HELD}
        elif run.early:
            lengths = {"rest": REST, "pressed flat": 1.0, "bending pressed": down}
            lengths |= {"pressed": PRESSED, "lifted": 2.0, "straightening": up, "after": AFTER}
        else:
            lengths = {"rest": REST, "bending": down, "held": HELD, "pressed": PRESSED}
            lengths |= {"lifted": 1.5, "straightening": up, "after": AFTER}
        ends = np.cumsum(list(lengths.values())).tolist()
        return cls(dict(zip(lengths, ends, strict=True)), float(run.begins_bent))

    def begin(self, *names: str) -> float:
        """Of the first part whose name begins with one of ``names``; never where there is none."""
        begun = 0.0
        for name, end in self.ends.items():
            if name.startswith(names):
                return begun
            begun = end
        return math.inf

    def part(self, begin: float, end: float) -> str:
        """The part in which all of a frame is, once it has settled; empty where it is in none."""
        begun = 0.0
        for name, over in self.ends.items():
            settled = SETTLED if name.startswith(("pressed", "lifted")) else 0.0
            if begun + settled <= begin and end <= over:
                return name
            begun = over
        return ""

    def bent(self, t: Floats) -> Floats:
        """(n,) part of the deformation that is imposed, smoothly in and out."""
        return self.first + self._passed("bending", t) - self._passed("straightening", t)

    def _passed(self, name: str, t: Floats) -> Floats:
        begin = self.begin(name)
        end = next((end for part, end in self.ends.items() if part.startswith(name)), math.inf)
        return _eased((t - begin) / (end - begin)) if end < math.inf else np.zeros(len(t))

    def pressed(self, t: Floats) -> Floats:
        """(n,) part of the presses' response; a little stays for a while."""
        down, lifted = self.begin("pressed"), self.begin("lifted")
        on = _eased((t - down) / PRESS_RAMP) - _eased((t - lifted) / PRESS_RAMP)
        kept = PRESS_KEPT * 0.5 ** np.maximum((t - lifted) / FORGET, 0.0) * (t > lifted)
        return np.maximum(on, kept)


def _eased(s: Floats) -> Floats:
    """From 0 to 1 with the least jerk (Flash & Hogan 1985, J. Neurosci. 5, 1688)."""
    s = np.clip(np.nan_to_num(s, neginf=0.0), 0.0, 1.0)
    return np.asarray(s**3 * (10 - 15 * s + 6 * s**2))


def _followed(course: Course, t: Floats) -> tuple[Floats, Floats]:
    """What the sheet follows of the deformation by now, with creep, and what of it stays."""
    grid = np.arange(0.0, max(course.ends.values()) + 0.01, 0.01)
    imposed = course.bent(grid)
    late = np.log1p(grid / CREEP_TIME) / np.log1p(30.0 / CREEP_TIME)
    crept = np.convolve(np.diff(imposed, prepend=0.0), late)[: len(grid)]
    up = course.begin("straightening")
    stays = (1 - imposed) * 0.5 ** (np.maximum(grid - up, 0.0) / FORGET) * (grid > up)
    follows = (1 - CREEP) * imposed + CREEP * crept
    return np.interp(t, grid, np.clip(follows, 0.0, 1.0)), np.interp(t, grid, stays)


class Bench:
    """The codes of a run's frames, by a polynomial between solved states."""

    def __init__(self, run: Run) -> None:
        prepared = run.prepared
        random = np.random.default_rng([run.seed, run.electrodes, 1])
        self.prepared, self.run, self.course = prepared, run, Course.of(run, random)
        self._law, self._kept = run.gauges, float(random.uniform(*KEPT))
        self._sheet = Sheet(prepared.skin, run.seed)
        self._converter = Converter(prepared.scan, prepared.skin.readout, random)
        points = self._sheet.inner.reshape(-1, 2)
        self._strain = strain_of(run.poses, points).reshape(-1, 3, 2, 2)
        size = np.abs(self._strain).max(axis=(2, 3), keepdims=True)
        beyond = np.clip(1 - YIELD * size.max() / np.maximum(size, 1e-12), 0.0, None)
        self._stays = self._kept * beyond * self._strain

    def frames(self) -> Iterator[tuple[str, float, Frame]]:
        """Each with the part of the course in which it is, and what the sheet follows by then."""
        skin, scan = self.prepared.skin, self.prepared.scan
        interval, rate = scan_time(self.prepared), skin.readout.tick_rate
        n = int(max(self.course.ends.values()) / interval)
        begin = np.arange(n) * interval
        middle = (np.arange(len(scan.drives)) + 0.5) / len(scan.drives) * interval
        codes = self._codes((begin[:, None] + middle).ravel(), n)
        follows, _ = _followed(self.course, begin + interval / 2)
        for k, (t, part, one) in enumerate(zip(begin, follows, codes, strict=True)):
            end = float(t) + interval
            frame = Frame(k, round(t * rate), end, 1, 0, 0, self._converter(one))
            yield self.course.part(float(t), end), float(part), frame

    def _codes(self, t: Floats, n: int) -> Floats:
        """(n, n_samples) of drives at ``t``, frame after frame."""
        part, stays = _followed(self.course, t)
        press = self.course.pressed(t)
        nodes = NODES if self.run.poses else np.zeros(1)
        weights = _lagrange(part, nodes)
        rest = self._solved(nodes)
        total = np.einsum("tk,ks->ts", weights, rest)
        if "straightening" in self.course.ends:
            kept = self._solved(nodes, kept=1.0) - rest
            total += stays[:, None] * np.einsum("tk,ks->ts", weights, kept)
        if self.run.balls:
            half, full = (self._solved(nodes, press=p) - rest for p in (0.5, 1.0))
            total += (press * (4 - 4 * press))[:, None] * np.einsum("tk,ks->ts", weights, half)
            total += (press * (2 * press - 1))[:, None] * np.einsum("tk,ks->ts", weights, full)
        total *= 1 + self.run.gain * (t > REST)[:, None]
        by_drive = total.reshape(n, -1, total.shape[1])
        samples = np.arange(total.shape[1])
        return np.asarray(by_drive[:, self.prepared.scan.sample_drive, samples])

    def _solved(self, nodes: Floats, press: float = 0.0, kept: float = 0.0) -> Floats:
        """(n_nodes, n_samples) with so much of the press and of what stays."""
        sheet, current = self._sheet, self.prepared.skin.current
        left = np.ones(self._strain.shape[:2])
        for ball in self.run.balls:
            left *= ball.left(sheet.inner.reshape(-1, 2), press).reshape(left.shape)
        out = []
        for node in nodes:
            tensor = sheet.conductance(self._law, node * self._strain + kept * self._stays, left)
            found = sheet.resistance(tensor, node * self._slid(), 1 + node * self._worse())
            out.append(self._converter.codes(found, current))
        return np.array(out)

    def _slid(self) -> Floats:
        """(n,) rad by which electrodes that stay are further along the rim of the sheet."""
        x, y = self.prepared.skin.electrode_centres.T
        gone = np.zeros(len(x))
        for pose in (p for p in self.run.poses if self.run.slides and isinstance(p, Fold)):
            moved = pose.shift(np.column_stack([x, y]))
            gone -= (x * moved[:, 1] - y * moved[:, 0]) / (x**2 + y**2)
        return gone

    def _worse(self) -> Floats:
        worse = np.zeros(self.prepared.skin.n_electrodes)
        if self.run.loosened is not None:
            worse[self.run.loosened] = LOOSE
        return worse


def _lagrange(t: Floats, nodes: Floats) -> Floats:
    """(n, k) weights of the values at ``nodes`` (k,)."""
    apart = t[:, None, None] - nodes
    others = ~np.eye(len(nodes), dtype=bool)
    scale = np.where(others, nodes[:, None] - nodes, 1.0)
    return np.asarray(np.where(others, apart / scale, 1.0).prod(axis=2))
