"""Years of a calibrated skin in minutes: wear, a cut, a new mounting, an electrode lost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

import numpy as np

from bench_rig import INSIDE_90, evenly
from report import Floats, Report, progress, table
from tomoskin import Locator, Skin
from tomoskin.board.source import ScanSettings
from tomoskin.core import Frame
from tomoskin.extras.alignment import in_session
from tomoskin.learning import Watch
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import triangulate
from tomoskin.model.pattern import Scan
from tomoskin.sensing.segment import Region
from tomoskin.sensing.signal import Readout
from tomoskin.twin import Press, Stretched, TwinSettings, TwinSkin, table_of
from tomoskin.twin.electronics import TwinElectronics

SKIN, SEEDS = "textile-disc-8", (71, 72)
LEARNT, LABELS, RUBBED, ASKED = 60, 10, 200, 60
"""Presses of the first day; each month: labelled ones, touches without labels, others asked."""

FORCES, RADIUS, REACH = (2.0, 6.0), 0.010, 0.85
"""N; m; part of the radius over which touches are spread."""

PRESSED, LIFTED, WARMER = 0.4, 2.0, 1.0
"""Seconds on and off; deviation of the room, K."""

WORN, GAINS = 0.01, 0.002
"""Conductivity that the middle loses each month, and by how much the channels' gains part."""

UNSURE = 0.25
"""Deviation, in radii, from which a touch counts as one of which nothing is said."""


@dataclass(frozen=True)
class Condition:
    """Of the skin in one month.

    ``cut``: part of the conductivity that is left in a cut; ``shift`` (2,) m by which the sheet
    lies beside its place, ``stretch`` by which it is longer; ``lost`` electrodes.
    """

    month: int
    event: str = "new"
    cut: float = 1.0
    shift: tuple[float, float] = (0.0, 0.0)
    stretch: float = 0.0
    lost: tuple[int, ...] = ()


EVENTS: dict[int, dict[str, Any]] = {
    3: {"event": "worn"},
    9: {"event": "cut", "cut": 0.02},
    12: {"event": "healed", "cut": 0.7},
    18: {"event": "mounted again", "shift": (0.003, -0.002), "stretch": 0.02},
    27: {"event": "electrode lost", "lost": (4,)},
    33: {"event": "mended", "lost": ()},
}
"""What happens at the beginning of a month, and stays."""

MONTHS = 36


def life() -> list[Condition]:
    """The condition in each month."""
    conditions = [Condition(0)]
    for month in range(1, MONTHS):
        conditions.append(replace(conditions[-1], month=month, **EVENTS.get(month, {})))
    return conditions


class Worn:
    """A twin in one condition; presses go on from where the last one left the sheet."""

    def __init__(self, skin: Skin, condition: Condition, seed: int) -> None:
        settings = TwinSettings.preset(skin.twin.preset, seed)
        flat = triangulate(skin.outline, skin.arcs, round(settings.mesh_ratio * skin.mesh_cells))
        model = ForwardModel(flat, skin.pattern(), skin.contact_impedance, skin.current)
        sheet = TwinSkin(
            model, skin.outline, skin.conductivity * left(flat.centroids, condition), settings
        )
        sheet.set_pose((Stretched(condition.stretch, axis=0.6),) if condition.stretch else ())
        sheet.warm(WARMER * float(np.random.default_rng((seed, condition.month)).normal()))
        parting = settings.electronics.gain_sd + GAINS * condition.month
        board = replace(settings.electronics, gain_sd=parting)
        self._board = TwinElectronics(sheet, skin.readout, skin.current, board, seed)
        scan = Scan.of(skin.pattern())
        self._readout = Readout.of(scan, skin.readout)
        self._table = table_of(scan, ScanSettings.of(skin))
        self._shift, self._time = np.array(condition.shift), 0.0
        used = np.hstack([skin.pattern().drive, skin.pattern().measure])
        self._missing = np.isin(used, condition.lost).any(axis=1)

    def __call__(self, xy: Floats, forces: Floats) -> Floats:
        """(n, n_meas) V: touched less untouched before; NaN of an electrode that is lost."""
        changes = []
        for (x, y), force in zip(xy + self._shift, forces, strict=True):
            rest = self._volts((), LIFTED)
            press = Press(float(x), float(y), force=float(force), radius=RADIUS)
            changes.append(self._volts((press,), PRESSED) - rest)
        return np.where(self._missing, np.nan, changes)

    def _volts(self, presses: tuple[Press, ...], seconds: float) -> Floats:
        self._board.sheet.set_presses(presses)
        self._time += seconds
        samples, sums = self._table.readings(self._board.sample(self._table, self._time))
        frame = Frame(0, 0, self._time, 0, 0, 0, samples=samples, sums=sums)
        return self._readout(frame).values


def left(points: Floats, condition: Condition) -> Floats:
    """(n,) part of the conductivity that is left at ``points`` (n, 2) m."""
    size = float(np.abs(points).max())
    often = np.exp(-((points**2).sum(axis=1)) / (0.5 * size) ** 2)
    worn = np.exp(-WORN * condition.month * (0.3 + 0.7 * often))
    along, across = points @ [0.8, 0.6], points @ [-0.6, 0.8]
    inside = (np.abs(across - 0.2 * size) < 0.02 * size) & (np.abs(along) < 0.4 * size)
    return np.asarray(worn * np.where(inside, condition.cut, 1.0))


def labelled(locator: Locator, skin: Worn, rng: np.random.Generator) -> Locator:
    """Some presses at known positions."""
    xy, forces = touches(locator.region, LABELS, rng)
    return locator.updated(skin(xy, forces), xy)


LIVES: dict[str, tuple[Callable[[Locator, Worn, np.random.Generator], Locator], bool]] = {
    "no labels": (lambda locator, _skin, _rng: locator, False),
    f"{LABELS} presses a month": (labelled, True),
    "rubbed each month": (
        lambda locator, skin, rng: in_session(locator, skin(*touches(locator.region, RUBBED, rng))),
        False,
    ),
}
"""What is done each month; and whether to the calibration of the month before, or the first."""


def touches(region: Region, n: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Positions (n, 2) m and forces (n,) N."""
    return region.metres(evenly(rng, n, REACH)), rng.uniform(*FORCES, n)


Worth = tuple[float, float, float, bool]
"""Of a calibration in a month: mean error m, part of the presses in their 90 % ellipses, part of
them of which so little is said that they count as unknown; whether the page says that it fits."""


def lived(seed: int, conditions: Sequence[Condition]) -> dict[str, list[Worth]]:
    """Each way of life, month by month."""
    skin = Skin.load(SKIN)
    region = Region.of(skin)
    xy, forces = touches(region, LEARNT, np.random.default_rng(seed))
    first = Locator.fit(Worn(skin, conditions[0], seed)(xy, forces), xy, skin=skin)
    newest, found = dict.fromkeys(LIVES, first), {name: list[Worth]() for name in LIVES}
    for condition in conditions:
        progress(f"seed {seed}, month {condition.month}")
        asked, hard = touches(region, ASKED, np.random.default_rng((seed, condition.month, 1)))
        dv = Worn(skin, condition, seed)(asked, hard)
        for name, (live, onwards) in LIVES.items():
            rng = np.random.default_rng((seed, condition.month, 2))
            locator = live(newest[name] if onwards else first, Worn(skin, condition, seed), rng)
            newest[name] = locator
            found[name].append(worth(locator, dv, asked))
    return found


def worth(locator: Locator, dv: Floats, xy: Floats) -> Worth:
    """Of presses at ``xy``, located one after the other as in a live run."""
    watch = Watch(locator)
    positions, covariances = watch(dv)
    off = positions - xy
    far = np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariances), off)
    size = np.sqrt(np.trace(covariances, axis1=1, axis2=2) / 2)
    unknown = size > UNSURE * locator.region.unit
    error = float(np.linalg.norm(off, axis=1).mean())
    return error, float((far < INSIDE_90).mean()), float(unknown.mean()), watch.health.well


def run() -> Iterator[Report]:
    lives, rows = [lived(seed, life()) for seed in SEEDS], []
    for event, months in groupby(life(), key=lambda condition: condition.event):
        numbers = [condition.month for condition in months]
        cells = {name: _cell([one[name][n] for one in lives for n in numbers]) for name in LIVES}
        rows.append({"condition": event, "months": f"{numbers[0]} to {numbers[-1]}"} | cells)
    yield table(
        f"{MONTHS / 12:g} years of {SKIN}",
        rows,
        "mean error in mm, part of the presses in the 90 % ellipses, part of them unknown "
        f"(deviation over {UNSURE:g} radii), part of the months in which the page "
        "says that the calibration fits badly",
        f"{LEARNT} presses learnt on the first day, {ASKED} others asked a month, "
        f"{FORCES[0]:g} to {FORCES[1]:g} N; seeds {SEEDS}; preset textile",
    )


def _cell(months: Sequence[Worth]) -> str:
    error, held, unknown, well = np.mean(months, axis=0)
    return f"{1e3 * error:.1f}, {held:.0%}, {unknown:.0%}, {1 - well:.0%}"
