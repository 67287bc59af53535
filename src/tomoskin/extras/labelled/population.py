"""Labelled frames: what presses are drawn from at random, and the frames of a set."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, Self

import msgspec
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from tomoskin import __version__
from tomoskin.core import FloatArray, ScriptError, SkinError, located
from tomoskin.model.mesh import Outline
from tomoskin.model.section import (
    Choice,
    OneOrMore,
    OneOrSpan,
    Quantity,
    Section,
    Whole,
    key,
    toml_tables,
)
from tomoskin.model.skin import Skin
from tomoskin.pipeline import REFERENCE_FRAMES
from tomoskin.sensing.signal import Readout
from tomoskin.twin import (
    FACES,
    FORMAT,
    PRESETS,
    SECTIONS as SCRIPT_SECTIONS,
    Probe,
    Scans,
    TwinSettings,
)

_GAP = Quantity("length", "mm", 0, 1000)

_STEP = 0.5e-3
"""Half extents are rounded to this, m: the dent of a face is solved once and used again."""

_TRIES = 2000
"""Places drawn for one probe before there is taken to be no room for it."""


class PressesSection(Section, section="presses"):
    """Distribution of labelled frames (`--presses N`), instead of a timeline. Every frame is drawn
    independently. Every value of a range is equally likely."""

    count: tuple[int, int] = key(OneOrSpan(Whole(0, 8)), "Number of presses at once.", default=1)
    shapes: tuple[str, ...] = key(
        OneOrMore(Choice(("circle", "square", "finger")), different=True),
        "Shapes of the faces. All are equally likely.",
        default="circle",
    )
    size: tuple[float, float] = key(
        OneOrSpan(Quantity("length", "mm", 0.5, 1000)),
        "Radius of a circle, half the side of a square, or length of a fingertip. It is rounded "
        "to 0.5 mm.",
    )
    force: tuple[float, float] = key(
        OneOrSpan(Quantity("force", "N", 0, 1000)), "Force of each press."
    )
    hold: float = key(
        Quantity("time", "s", 0.01, 3600),
        "How long the sheet has been pressed. It creeps meanwhile.",
        default="1 s",
    )
    margin: float = key(_GAP, "Smallest distance of a probe's middle from the rim.", default="5 mm")
    apart: float = key(
        _GAP, "Smallest distance between the middles of two probes.", default="40 mm"
    )
    preset: str | None = key(
        Choice(tuple(PRESETS)),
        "The twin's material and board, instead of the skin's own.",
        default=None,
    )


class Population(PressesSection):
    """Ranges that presses are drawn from, evenly and independently: a script's ``[presses]``.

    Half extents ``size`` and ``margin`` and ``apart`` are in m, ``force`` in N, ``hold`` in s.
    """

    @classmethod
    def from_toml(cls, text: str, *, source: str = "script") -> Self:
        """Population of a script's section ``[presses]``.

        Raises
        ------
        ScriptError
            For an unknown or missing key, or a value that cannot be meant.
        """
        with located("", ScriptError, SkinError):
            tables = toml_tables(text, source, FORMAT, [*SCRIPT_SECTIONS, cls.section])
            others = [name for name in tables if name != cls.section]
            if others or cls.section not in tables:
                raise ScriptError(
                    f"expected only the section [presses], got {', '.join(tables) or 'none'}",
                    where=f"{source}: [{others[0]}]" if others else source,
                    hint="labelled frames have no timeline: leave --presses out to run one",
                )
            return cls.read(tables[cls.section], f"{source}: {cls.heading}")

    def draw(self, outline: Outline, random: np.random.Generator) -> tuple[Probe, ...]:
        """Presses of one frame on a sheet of that ``outline``.

        Raises
        ------
        ScriptError
            When there is no room for as many, so far from each other and the rim.
        """
        number = int(random.integers(self.count[0], self.count[1] + 1))
        positions = np.empty((0, 2))
        for _ in range(number):
            positions = np.vstack([positions, self._place(outline, positions, random)])
        return tuple(self._probe(position, random) for position in positions)

    def _place(
        self, outline: Outline, others: FloatArray, random: np.random.Generator
    ) -> FloatArray:
        corners = outline.polyline(outline.length / 64)
        low, high = corners.min(axis=0), corners.max(axis=0)
        for _ in range(_TRIES):
            position = np.asarray(random.uniform(low, high))
            if self._has_room(outline, position, others):
                return position
        raise ScriptError(
            f"found no position {1e3 * self.margin:g} mm from the rim and "
            f"{1e3 * self.apart:g} mm from {len(others)} other probes",
            where="[presses] margin, apart",
            hint="use fewer presses, or smaller distances",
        )

    def _has_room(self, outline: Outline, position: FloatArray, others: FloatArray) -> bool:
        if len(others) and np.hypot(*(others - position).T).min() < self.apart:
            return False
        if not outline.contains(position[None])[0]:
            return False
        rim = outline.point(outline.nearest(position[None]))[0]
        return bool(np.hypot(*(rim - position)) >= self.margin)

    def _probe(self, position: FloatArray, random: np.random.Generator) -> Probe:
        shape = self.shapes[random.integers(len(self.shapes))]
        size = _STEP * round(random.uniform(*self.size) / _STEP)
        force, angle = random.uniform(*self.force), random.uniform(0, 2 * np.pi)
        face = FACES[shape](max(size, _STEP))
        return Probe(face, float(position[0]), float(position[1]), float(force), float(angle))


SECTIONS = {PressesSection.section: PressesSection}
"""Sections of a script that are its own."""

COMMON_PRESSES = Population(
    count=(1, 1),
    shapes=("circle",),
    size=(8e-3, 20e-3),
    force=(1.0, 8.0),
    hold=1.0,
    margin=5e-3,
    apart=40e-3,
)
"""What is drawn from where nothing is said: one round probe of a finger's to a palm's size."""


SHARD_FRAMES = 500
"""Frames of a shard: what is drawn from one seed, and written as one file."""

_LABELS = 3
"""Version of the labels: sets of different ones are not continued."""

Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class SetPlan:
    """A set of labelled frames; the same plan makes the same frames, on whatever machine.

    Attributes
    ----------
    skin
        Text of the skin file.
    population
        What the presses are drawn from.
    preset
        Name of the twin's settings.
    seed
        Of everything. Shard k draws from child k + 1 of ``SeedSequence(seed)``, the reference
        from child 0, the sheet itself (its spread, its channels) from the seed.
    n_frames
        In the whole set.
    """

    skin: str
    population: Population
    preset: str
    seed: int
    n_frames: int

    def __post_init__(self) -> None:
        """Check that there is a frame to make."""
        if self.n_frames < 1:
            raise ScriptError(f"expected at least 1 frame, got {self.n_frames}", where="--presses")

    @property
    def n_shards(self) -> int:
        """The number of shards that hold all frames."""
        return -(-self.n_frames // SHARD_FRAMES)

    def size(self, shard: int) -> int:
        """The number of frames in this shard."""
        return min(SHARD_FRAMES, self.n_frames - shard * SHARD_FRAMES)

    @cached_property
    def identity(self) -> str:
        """Short hash of all that a frame of the set depends on; how many there are is not it."""
        content = (__version__, _LABELS, self.skin, self.population, self.preset, self.seed)
        return hashlib.sha256(msgspec.json.encode(content)).hexdigest()[:16]


def make_shard(plan: SetPlan, shard: int) -> Arrays:
    """The frames of one shard as arrays of an interchange file, labels beside them.

    ``voltages`` (n, n_meas) and ``reference`` (n_meas,) V, ``drive``, ``measure``; ``xy_m``
    (n, 2), ``force_n`` and ``depth_m`` (n,) where there is exactly one press, else NaN, as
    calibrations read them. Of each press, NaN or "" where a frame has fewer: ``press_xy_m``
    (n, most, 2), ``press_force_n``, ``press_depth_m``, ``radius_m`` (of the circle with the area
    of the face), ``angle_rad`` and ``shape`` (n, most).

    Raises
    ------
    ScriptError
        When there is no room on the skin for what is to be drawn.
    """
    draws, noise = np.random.SeedSequence(plan.seed, spawn_key=(shard + 1,)).spawn(2)
    random = np.random.default_rng(draws)
    with threadpool_limits(1):  # a frame's products are small, and sums keep their order
        lab = _lab(plan)
        presses = [plan.population.draw(lab.skin.outline, random) for _ in range(plan.size(shard))]
        voltages = lab.read(presses, plan.population.hold, noise)
    table = lab.skin.pattern()
    return {
        "voltages": voltages,
        "reference": lab.reference,
        "drive": table.drive,
        "measure": table.measure,
        "identity": np.array(f"{plan.identity} {shard} {len(voltages)}"),
    } | _labels(presses, plan.population.count[1], lab.sheet.depth_under)


class _Lab:
    """A twin at rest before each frame, and its board; made once per process and set."""

    def __init__(self, plan: SetPlan) -> None:
        self.skin = Skin.from_toml(plan.skin, source="skin of the set")
        self._scans = Scans(self.skin, TwinSettings.preset(plan.preset, plan.seed))
        self._readout = Readout.of(self._scans.scan, self.skin.readout)
        self.sheet = self._scans.electronics.sheet
        idle = np.random.SeedSequence(plan.seed, spawn_key=(0,))
        self.reference: FloatArray = self.read(
            [()] * REFERENCE_FRAMES, plan.population.hold, idle
        ).mean(axis=0)

    def read(
        self, presses: list[tuple[Probe, ...]], hold: float, noise: np.random.SeedSequence
    ) -> FloatArray:
        """(n, n_meas) V: each frame of a sheet that nothing pressed before, after ``hold`` s."""
        sheet, frame = self.sheet, self._scans.frame
        self._scans.renew(noise)
        frame(0, 0.0)
        measured = []
        for number, probes in enumerate(presses, start=1):
            sheet.renew()
            sheet.set_presses(probes)
            measured.append(self._readout(frame(number, number * hold)).values)  # after hold
        return np.stack(measured)


@lru_cache(maxsize=2)
def _lab(plan: SetPlan) -> _Lab:
    return _Lab(plan)


def _labels(
    presses: list[tuple[Probe, ...]], most: int, depth_under: Callable[[Probe], float]
) -> Arrays:
    shape = (len(presses), max(most, 1))
    positions = np.full((*shape, 2), np.nan)
    force, depth, radius, angle = (np.full(shape, np.nan) for _ in range(4))
    name = np.full(shape, "", dtype="<U12")
    for row, probes in enumerate(presses):
        for column, probe in enumerate(probes):
            positions[row, column] = probe.x, probe.y
            force[row, column], radius[row, column] = probe.force, probe.radius
            angle[row, column], depth[row, column] = probe.angle, depth_under(probe)
            name[row, column] = type(probe.shape).__name__.lower()
    single = np.array([len(probes) == 1 for probes in presses])
    return {
        "xy_m": np.where(single[:, None], positions[:, 0], np.nan),
        "force_n": np.where(single, force[:, 0], np.nan),
        "depth_m": np.where(single, depth[:, 0], np.nan),
        "press_xy_m": positions,
        "press_force_n": force,
        "press_depth_m": depth,
        "radius_m": radius,
        "angle_rad": angle,
        "shape": name,
    }
