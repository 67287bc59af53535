"""Figure 6.4: six expressions of a face, recognised by eight electrodes that they move.

The electrodes sit on a shell of two tissues (face.py), 1 mA through neighbouring ones. Each
session attaches them again, 2 mm off, on a face 10 % more or less conductive; an expression is 15 %
stronger or weaker from session to session and from run to run, each bump of it by itself. Every
frame is taken against a relaxed one just before it. Two sessions of eight runs are learnt, four
are asked.

With direct current, an electrode that has just driven stays polarised, otherwise in every scan:
2 mV are assumed on each reading. At 50 kHz that is not seen, and tissue answers with two numbers.

Shown: pictures of the six expressions of one run, with the noise of that run, with the true
movement of each electrode and the one that was found.
Thesis saw: with direct current, only "A" and the smile are recognised.
Checked: with complex data at least 5 of 6 are right in 90 % of the runs, and in more than with
direct current. Of a picture with movement, the electrode that is said to have moved most is one
of the three that did in 3 of 4 pictures at least, over all runs of a session.
Assumed: the face, how its expressions move it, and the noise of direct current. With 2 mV most
expressions are still recognised, with 8 mV few. But then it is not "A" and the smile that remain,
as in the thesis: why those two stood out is not explained by the model. Which electrodes moved is
read with the noise of the read-out; with 2 mV of polarisation the right one is named little more
often than by chance, which is 3 of 8.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.linalg import solve

import figures
from bodies import options_of
from face import CONTACT, EXPRESSIONS, Bump, Face, face, movement
from lab import report
from tomoskin.core import ComplexArray, FloatArray
from tomoskin.extras.classes import Classifier
from tomoskin.imaging import LinearProblem
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import Matern

PATTERN = Pattern.adjacent(8)
CURRENT = 1e-3
CELLS, FINE = 900, 1200
"""Flat triangles under the model of pictures, and under the one that makes data."""

LEARNT, ASKED, RUNS = 2, 4, 8
PLACED, TISSUE, STRENGTH = 2.0, 0.1, 0.15
WAVER, ASTRAY = 0.15, 0.3e-3
"""From run to run each electrode goes elsewhere by that part of its way, and by so many m."""

STRONG = 8e-3
"""V, where few expressions are left."""

READ = 20e-6
"""V, standard deviation of a row by the read-out, of each part of a complex one."""

POLARISED = 2e-3
"""V, of a row, with direct current only; assumed."""

CHANGE, MOVING, MISFIT = 0.1, 4e-3, 0.01
"""What is held to be likely in a picture: Δσ/σ, m that an electrode moves, error of the model."""

NAMES = tuple(EXPRESSIONS)


@dataclass(frozen=True, eq=False)
class Session:
    """What one putting on of the electrodes gives.

    Attributes
    ----------
    relaxed
        (n_meas,) V.
    changes
        (6, n_meas) V of each expression.
    moved
        (6, 8) m that each electrode goes.
    slope
        (n_meas, 8, 3) V/m by the place of each electrode.
    """

    relaxed: ComplexArray
    changes: ComplexArray
    moved: FloatArray
    slope: ComplexArray


@dataclass(frozen=True, eq=False)
class Frames:
    """Changes (n, n_meas) in parts of the relaxed voltage, and (n,) which expression."""

    dv: ComplexArray
    label: NDArray[np.str_]


def model_of(one: Face) -> State:
    """The state of a face."""
    return ForwardModel(one.mesh, PATTERN, CONTACT, CURRENT).at(one.tissue)


def session(random: np.random.Generator) -> Session:
    """Electrodes put on anew; each expression solved exactly, as strong as it is today."""
    relaxed = face(FINE, seed=7, shift=random.normal(0.0, PLACED, (8, 2)))
    before = electrodes(relaxed)
    scale = np.exp(random.normal(0.0, TISSUE))
    state = model_of(relaxed)
    rest = state.voltages / scale
    changes, moved = [], []
    for bumps in EXPRESSIONS.values():
        today = [_varied(bump, random) for bump in bumps]
        one = relaxed.moved(today)
        changes.append(model_of(one).voltages / scale - rest)
        moved.append(np.linalg.norm(electrodes(one) - before, axis=1))
    return Session(rest, np.array(changes), np.array(moved), state.movement_jacobian / scale)


def _varied(bump: Bump, random: np.random.Generator) -> Bump:
    at, radius, by = bump
    x, y, z = np.array(by) * np.exp(random.normal(0.0, STRENGTH))
    return at, radius, (x, y, z)


def electrodes(one: Face) -> FloatArray:
    """(8, 3) m."""
    return np.array(
        [one.mesh.points[np.unique(facets)].mean(axis=0) for facets in one.mesh.electrodes]
    )


def frames_of(
    one: Session, random: np.random.Generator, *, direct: bool, polarised: float | None = None
) -> Frames:
    """``RUNS`` runs through all expressions, measured with direct or with alternating current."""
    polarised = POLARISED if polarised is None else polarised
    rows, label = [], []
    size = np.abs(one.relaxed)
    for _ in range(RUNS):
        for number, name in enumerate(NAMES):
            strength = np.exp(random.normal(0.0, STRENGTH))
            noise = READ * random.standard_normal((2, len(size))) * np.sqrt(2)
            astray = (WAVER * one.moved[number] + ASTRAY) * random.standard_normal((3, 8))
            change = strength * one.changes[number] + noise[0] + 1j * noise[1]
            change += np.einsum("med,de->m", one.slope, astray)
            if direct:
                change = change.real + polarised * np.sqrt(2) * random.standard_normal(len(size))
            rows.append(change / size)
            label.append(name)
    return Frames(np.array(rows), np.array(label))


def _between(potentials: FloatArray) -> FloatArray:
    """(n_meas,) V that electrodes' own potentials (8,) add to every row."""
    plus, minus = PATTERN.measure.T
    return np.asarray(potentials[plus] - potentials[minus])


def features(dv: ComplexArray) -> FloatArray:
    """(n, 2·n_meas) both parts; (n, n_meas) of real data."""
    return np.hstack([dv.real, dv.imag]) if np.iscomplexobj(dv) else dv


def told(
    sessions: Sequence[Session], seed: int, *, direct: bool, polarised: float | None = None
) -> NDArray[np.bool_]:
    """(runs, 6) whether each expression of each asked run was told right."""
    random = np.random.default_rng([seed, int(direct)])
    taken = [frames_of(one, random, direct=direct, polarised=polarised) for one in sessions]
    first, *more = taken[:LEARNT]
    known = Classifier.fit(features(first.dv), first.label)
    for one in more:
        known = known.in_session(
            features(one.dv), known.examples.codes.flags_of(one.label.tolist())
        )
    right = []
    for one in taken[LEARNT:]:
        x = features(one.dv)
        right.append(np.array(known.in_session(x).predict(x).label) == one.label)
    return np.concatenate(right).reshape(-1, len(NAMES))


class Moving:
    """Pictures in which electrodes move too (Soleimani, Gómez-Laberge & Adler 2006).

    A step in conductivity and places together, each with its own prior: the data's covariance is
    J C Jᵀ + s² M Mᵀ + n², with the movement Jacobian M. The model's face stands relaxed.
    """

    def __init__(self) -> None:
        self.face = face(CELLS)
        state = model_of(self.face)
        tissue = self.face.tissue
        problem = LinearProblem.of(state.model, Matern(25e-3), conductivity=tissue)
        size = np.abs(state.voltages)[:, None]
        by_tissue = (problem.jacobian * tissue).real / size
        spread, gram = problem.prior.carry(by_tissue)
        by_place = (state.movement_jacobian.real / size[..., None]).reshape(len(size), -1)
        data = CHANGE**2 * gram + MOVING**2 * by_place @ by_place.T
        data += np.diag((READ / size.ravel()) ** 2 + MISFIT**2)
        self._image = CHANGE**2 * solve(data, spread.T, assume_a="pos").T
        self._places = MOVING**2 * solve(data, by_place, assume_a="pos").T

    def __call__(self, dv: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """(n_cells,) Δσ/σ and (8, 3) m of a change ``dv`` (n_meas,) in parts of the voltage."""
        return np.asarray(self._image @ dv.real), (self._places @ dv.real).reshape(8, 3)


def whole_runs(right: NDArray[np.bool_]) -> float:
    """Part of the runs of which at least 5 of 6 expressions are right."""
    return float((right.sum(axis=1) >= len(NAMES) - 1).mean())


@cache
def sessions_of(seed: int, count: int = LEARNT + ASKED) -> list[Session]:
    """So many, each with chance of its own."""
    return [session(np.random.default_rng([seed, number])) for number in range(count)]


Picture = tuple[FloatArray, FloatArray]


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Move, measure, tell, draw; the numbers that were checked."""
    options = options_of("fig64_face", arguments, __doc__)
    sessions = sessions_of(options.seed)
    direct, both = (told(sessions, options.seed, direct=one) for one in (True, False))
    found = {
        "direct current: right": float(direct.mean()),
        "direct current: runs with 5 of 6": whole_runs(direct),
        "complex: right": float(both.mean()),
        "complex: runs with 5 of 6": whole_runs(both),
    }
    assert found["complex: runs with 5 of 6"] >= 0.9, f"complex data: {found}"
    assert whole_runs(both) > whole_runs(direct), f"direct current is as good: {found}"
    strong = told(sessions, options.seed, direct=True, polarised=STRONG).mean(axis=0)
    found |= {
        f"direct, 8 mV: {name} right": float(p) for name, p in zip(NAMES, strong, strict=True)
    }
    moving = Moving()
    pictures, named = moved_pictures(moving, sessions[0], options.seed, direct=False)
    assert named >= 0.75, f"the electrode that moved most is named in {100 * named:.0f} %"
    options.figure.save(draw(moving.face, pictures))
    blurred = moved_pictures(moving, sessions[0], options.seed, direct=True)[1]
    return found | {
        "moving electrode named": named,
        "moving electrode named, direct current": blurred,
    }


def moved_pictures(
    moving: Moving, one: Session, seed: int, *, direct: bool
) -> tuple[list[Picture], float]:
    """Pictures of the first run of a session, and the part of all with a right electrode."""
    taken = frames_of(one, np.random.default_rng([seed, 2, int(direct)]), direct=direct)
    pictures = [moving(dv) for dv in taken.dv]
    named = most_moved(pictures, np.tile(one.moved, (RUNS, 1)))
    return pictures[: len(NAMES)], float(named.mean())


def most_moved(pictures: Sequence[Picture], moved: FloatArray) -> NDArray[np.bool_]:
    """(n,) whether the electrode said to have moved most is among the three that did."""
    said = [np.linalg.norm(places, axis=1).argmax() for _, places in pictures]
    return np.array([
        one in np.argsort(-way)[:3] for one, way in zip(said, moved, strict=True)
    ])  # fmt: skip


def draw(one: Face, pictures: Sequence[Picture]) -> Figure:
    """The skin from the front, six times: its picture, and how electrodes moved."""
    made, axes = figures.figure(2, 3, (8.2, 6.6), sharex=True, sharey=True)
    limit = 100 * max(float(np.percentile(np.abs(image), 99)) for image, _ in pictures)
    skin, cells = on_top(one)
    at = figures.MM * electrodes(one)
    for ax, name, (image, places) in zip(axes.ravel(), NAMES, pictures, strict=True):
        drawn = ax.tripcolor(
            *(figures.MM * one.mesh.points[:, :2].T), skin, facecolors=100 * image[cells],
            cmap=figures.MAP, vmin=-limit, vmax=limit, rasterized=True,
        )  # fmt: skip
        true = figures.MM * movement(electrodes(one), EXPRESSIONS[name])
        arrows(ax, at, true, "0.45", "true")
        arrows(ax, at, figures.MM * places, "black", "found")
        ax.set_aspect("equal")
        ax.set_title(name)
    for ax in axes[1]:
        ax.set_xlabel("x / mm")
    for ax in axes[:, 0]:
        ax.set_ylabel("y / mm")
    axes[0, 0].legend(loc="lower left", fontsize=7)
    figures.letters(axes.ravel())
    made.colorbar(drawn, ax=axes, label="change of conductivity / %", shrink=0.6)
    return made


def arrows(ax: Axes, at: FloatArray, by: FloatArray, colour: str, name: str) -> None:
    """How electrodes at (8, 3) mm moved, (8, 3) mm; a move of 10 mm is drawn 20 mm long."""
    ax.plot(*at[:, :2].T, "o", color="0.2", markersize=2.5)
    ax.quiver(
        *at[:, :2].T, *by[:, :2].T, color=colour, angles="xy", scale_units="xy", scale=0.5,
        width=0.007, label=name,
    )  # fmt: skip


def on_top(one: Face) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(n, 3) triangles of the skin, and (n,) the cell under each."""
    outer = one.skin[one.mesh.cells]
    under = np.flatnonzero(outer.sum(axis=1) == 3)
    return one.mesh.cells[under][outer[under]].reshape(-1, 3), under


if __name__ == "__main__":
    report(main())
