"""Labelled frames: presses drawn at random, and what the board reads of them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from tomoskin import __version__
from tomoskin.board.source import ScanSettings
from tomoskin.core import FloatArray, Frame, ScriptError
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Readout
from tomoskin.twin.electronics import TwinElectronics
from tomoskin.twin.population import Population
from tomoskin.twin.presets import TwinSettings
from tomoskin.twin.probe import Probe
from tomoskin.twin.scanning import table_of
from tomoskin.twin.sheet import TwinSkin

REFERENCE_FRAMES = 20
"""Idle frames whose mean is the reference of a set."""

SHARD_FRAMES = 500
"""Frames of a shard: what is drawn from one seed, and written as one file."""

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
        """Check the number of frames."""
        if self.n_frames < 1:
            raise ScriptError(f"expected at least 1 frame, got {self.n_frames}", where="--presses")

    @property
    def n_shards(self) -> int:
        """Number of shards."""
        return -(-self.n_frames // SHARD_FRAMES)

    def size(self, shard: int) -> int:
        """Frames of a shard."""
        return min(SHARD_FRAMES, self.n_frames - shard * SHARD_FRAMES)

    @cached_property
    def identity(self) -> str:
        """Short hash of all that a frame of the set depends on; how many there are is not it."""
        content = (__version__, self.skin, self.population, self.preset, self.seed)
        return hashlib.sha256(msgspec.json.encode(content)).hexdigest()[:16]


def make_shard(plan: SetPlan, shard: int) -> Arrays:
    """The frames of one shard as arrays of an interchange file, labels beside them.

    ``voltages`` (n, n_meas) and ``reference`` (n_meas,) V, ``drive``, ``measure``; ``xy_m``
    (n, 2) where there is exactly one press, else NaN. Of each press, NaN or "" where a frame has
    fewer: ``press_xy_m`` (n, most, 2), ``force_n``, ``radius_m`` (of the circle with the area of
    the face), ``angle_rad`` and ``shape`` (n, most).

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
    } | _labels(presses, plan.population.count[1])


class _Lab:
    """A twin at rest before each frame, and its board; made once per process and set."""

    def __init__(self, plan: SetPlan) -> None:
        self.skin = Skin.from_toml(plan.skin, source="skin of the set")
        settings = TwinSettings.preset(plan.preset, plan.seed)
        settings = settings.with_electrodes(self.skin.twin.electrodes)
        self._sheet = TwinSkin.of(self.skin, settings)
        self._board = TwinElectronics(
            self._sheet, self.skin.readout, self.skin.current, settings.electronics, plan.seed
        )
        scan = Scan.of(self.skin.pattern())
        self._readout = Readout.of(scan, self.skin.readout)
        self._table = table_of(scan, ScanSettings.of(self.skin))
        idle = np.random.SeedSequence(plan.seed, spawn_key=(0,))
        self.reference: FloatArray = self.read(
            [()] * REFERENCE_FRAMES, plan.population.hold, idle
        ).mean(axis=0)

    def read(
        self, presses: list[tuple[Probe, ...]], hold: float, noise: np.random.SeedSequence
    ) -> FloatArray:
        """(n, n_meas) V: each frame of a sheet that nothing pressed before, after ``hold`` s."""
        sheet, board = self._sheet, self._board
        of_sheet, of_board = noise.spawn(2)
        sheet.renew(of_sheet)
        board.renew(of_board)
        board.sample(self._table, 0.0)
        rows = []
        for number, probes in enumerate(presses, start=1):
            sheet.renew()
            sheet.set_presses(probes)
            counts = board.sample(self._table, number * hold)  # lets the sheet go on by hold
            frame = Frame(number, 0, number * hold, 1, 0, 0, *self._table.readings(counts))
            rows.append(self._readout(frame).values)
        return np.stack(rows)


@lru_cache(maxsize=2)
def _lab(plan: SetPlan) -> _Lab:
    return _Lab(plan)


def _labels(presses: list[tuple[Probe, ...]], most: int) -> Arrays:
    shape = (len(presses), max(most, 1))
    place = np.full((*shape, 2), np.nan)
    force, radius, angle = (np.full(shape, np.nan) for _ in range(3))
    name = np.full(shape, "", dtype="<U12")
    for row, probes in enumerate(presses):
        for column, probe in enumerate(probes):
            place[row, column] = probe.x, probe.y
            force[row, column], radius[row, column] = probe.force, probe.radius
            angle[row, column] = probe.angle
            name[row, column] = type(probe.shape).__name__.lower()
    single = np.array([len(probes) == 1 for probes in presses])
    return {
        "xy_m": np.where(single[:, None], place[:, 0], np.nan),
        "press_xy_m": place,
        "force_n": force,
        "radius_m": radius,
        "angle_rad": angle,
        "shape": name,
    }
