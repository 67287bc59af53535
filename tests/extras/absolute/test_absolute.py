"""Absolute imaging: from another mesh's voltages to conductivity, background and contacts."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from shapes import box, disc, patched
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.extras.absolute import AbsoluteImaging, Observation, homogeneous
from tomoskin.extras.absolute.newton import Descent, Goal, descend, minimiser
from tomoskin.extras.absolute.unknowns import Joint, LinearMap, Unknowns, others
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import Diagonal, Laplace, Noser, Sparse, TotalVariation

LESS, MORE = np.array([-0.04, -0.02]), np.array([0.04, 0.03])
NOISE = 1e-3
PRIORS: dict[str, tuple[Any, float]] = {
    "laplace": ("laplace", 1.0),
    "noser": (Noser(), 0.1),
    "identity": ("identity", 0.3),
    "matern": ("matern", 0.5),
    "total variation": (TotalVariation(), 3.0),
}


@cache
def pattern() -> Pattern:
    """Driven electrodes are read too: only they tell contact impedances."""
    return Pattern.adjacent(16, include_driven=True)


@cache
def impedance() -> FloatArray:
    return np.random.default_rng(0).uniform(0.005, 0.02, 16)


@cache
def seen() -> Observation:
    """Voltages of a finer mesh, background 2 S, one region of 5 S and one of 0.4 S."""
    mesh = disc(16, 1500)
    sigma = np.full(len(mesh.cells), 2.0)
    sigma[np.linalg.norm(mesh.centroids - MORE, axis=1) < 0.03] = 5.0
    sigma[np.linalg.norm(mesh.centroids - LESS, axis=1) < 0.025] = 0.4
    v = ForwardModel(mesh, pattern(), impedance()).solve(sigma).voltages
    noise = NOISE * (np.abs(v) + 0.05 * np.abs(v).max())
    return Observation.of(v + noise * np.random.default_rng(1).standard_normal(len(v)), noise)


@cache
def coarse(cells: int = 500) -> Mesh:
    return disc(16, cells)


def value(mesh: Mesh, conductivity: FloatArray, place: FloatArray) -> float:
    """Median within 1 cm."""
    near = np.linalg.norm(mesh.centroids - place, axis=1) < 0.01
    return float(np.median(conductivity[near]))


@pytest.mark.parametrize("name", PRIORS)
def test_conductivity_itself_is_found(name: str) -> None:
    prior, alpha = PRIORS[name]
    imaging = AbsoluteImaging(
        ForwardModel(coarse(), pattern(), 0.01), prior, alpha=alpha, contacts="each"
    )
    found = imaging(seen())
    sigma = found.conductivity.values
    assert value(coarse(), sigma, np.array([0.0, -0.07])) == pytest.approx(2.0, rel=0.15)
    assert value(coarse(), sigma, MORE) > 3.2
    assert value(coarse(), sigma, LESS) < 1.0
    assert (sigma > 0).all()
    assert found.conductivity.unit == "S"
    assert found.conductivity.mesh_id == coarse().identity
    assert (np.diff([step.objective for step in found.descent.steps]) < 0).all()
    # 1 mV/V of a mesh with a third of the cells: its own error is a part of the misfit
    assert found.misfit < 10 * found.n_values


def test_contact_impedances_are_found_beside_the_image() -> None:
    imaging = AbsoluteImaging(
        ForwardModel(coarse(), pattern(), 0.01), "laplace", alpha=1.0, contacts="each"
    )
    found = imaging(seen()).contact_impedance
    assert np.corrcoef(np.log(found), np.log(impedance()))[0, 1] > 0.95
    assert found == pytest.approx(impedance(), rel=0.35)


def test_wrong_contact_impedances_leave_what_no_image_explains() -> None:
    model = ForwardModel(coarse(300), pattern(), 0.05)
    fixed, one, each = (
        AbsoluteImaging(model, "laplace", alpha=1.0, contacts=kind)(seen()).misfit
        for kind in ("fixed", "one", "each")
    )
    assert fixed > 2 * one
    assert one > each


def test_uniform_medium_and_common_contact() -> None:
    mesh = coarse()
    true = ForwardModel(mesh, pattern(), 0.007)
    v = true.solve(3.0).voltages
    found = homogeneous(
        ForwardModel(mesh, pattern(), 0.02), Observation.of(v, 1e-5 * np.abs(v).max()), "one"
    )
    assert found.background == pytest.approx(3.0, rel=1e-3)
    assert found.contact_impedance == pytest.approx(np.full(16, 0.007), rel=1e-2)
    assert found.misfit < 1.0
    assert found.voltages == pytest.approx(v, abs=1e-4 * np.abs(v).max())


def test_a_volume_of_tetrahedra() -> None:
    """A bar with an electrode at each end and four on a side; its far third conducts less."""
    bar = box(np.linspace(0, 0.3, 10), np.linspace(0, 0.1, 4), np.linspace(0, 0.1, 4))
    near = [
        (lambda x, at=at: (np.abs(x[:, 0] - at) < 0.03) & (x[:, 1] == 0) & (x[:, 2] < 0.05))
        for at in (0.05, 0.12, 0.18, 0.25)
    ]
    mesh = patched(bar, lambda x: x[:, 0] == 0, lambda x: x[:, 0] == 0.3, *near)
    drive = [[0, 1]] * 5 + [[2, 5]] * 3 + [[3, 4]] * 2
    measure = [[0, 2], [2, 3], [3, 4], [4, 5], [5, 1], [0, 3], [3, 4], [4, 1], [2, 5], [0, 1]]
    model = ForwardModel(mesh, Pattern.from_tables(drive, measure), 1e-4, 0.01)
    sigma = np.where(mesh.centroids[:, 0] < 0.2, 1.0, 0.3)
    v = model.solve(sigma).voltages
    found = AbsoluteImaging(model, Laplace(), alpha=0.05)(Observation.of(v, 1e-4 * np.abs(v)))
    assert found.conductivity.unit == "S/m"
    values = found.conductivity.values
    assert np.median(values[mesh.centroids[:, 0] < 0.15]) == pytest.approx(1.0, rel=0.15)
    assert np.median(values[mesh.centroids[:, 0] > 0.25]) == pytest.approx(0.3, rel=0.15)
    assert found.misfit < 5 * found.n_values


def test_data_may_be_combinations_of_the_voltages() -> None:
    """Turned in the space of the data, and measured twice over: the same image."""
    model = ForwardModel(coarse(300), pattern(), 0.01)
    v, noise = seen().values, 1e-3 * np.abs(seen().values).max()
    turned = np.linalg.qr(np.random.default_rng(3).standard_normal((len(v), len(v))))[0]
    combine = np.vstack([turned, turned])
    plain = AbsoluteImaging(model, alpha=1.0)(Observation.of(v, noise))
    mixed = AbsoluteImaging(model, alpha=1.0)(
        Observation.of(combine @ v, np.sqrt(2.0) * noise, combine)
    )
    assert mixed.n_values == len(v)
    assert mixed.conductivity.values == pytest.approx(plain.conductivity.values, rel=1e-3)


def test_l1_changes_few_cells() -> None:
    model = ForwardModel(coarse(300), pattern(), impedance())
    few, many = (
        np.abs(np.log(found.conductivity.values / found.background))
        for prior, alpha in ((Sparse(0.1), 10.0), ("identity", 0.3))
        for found in [AbsoluteImaging(model, prior, alpha=alpha)(seen())]
    )
    assert np.median(few) < 0.3 * np.median(many)


def test_record_explains_itself() -> None:
    model = ForwardModel(coarse(300), pattern(), 0.01)
    short = AbsoluteImaging(model, alpha=1.0, steps=2)(seen())
    assert "stopped: reached the limit of 2 steps" in str(short)
    assert len(short.descent.steps) == 3
    done = AbsoluteImaging(model, alpha=30.0)(seen())
    assert "of its value" in done.descent.reason
    assert f"of {done.n_values} values" in str(done)


@pytest.mark.parametrize("contacts", ["fixed", "one", "each"])
def test_jacobian_is_the_derivative_by_every_unknown(contacts: Any) -> None:
    mesh = coarse(300)
    model = ForwardModel(mesh, pattern(), impedance())
    rows = np.random.default_rng(0).standard_normal((7, pattern().n_meas))
    unknowns = Unknowns(
        model, LinearMap.of_cells(len(mesh.cells), len(mesh.cells)), 2.0, contacts, rows
    )
    rng = np.random.default_rng(1)
    x, step = 0.3 * rng.standard_normal((2, unknowns.size))
    h = 1e-5
    slope = (unknowns.at(x + h * step).predicted - unknowns.at(x - h * step).predicted) / (2 * h)
    assert unknowns.at(x).jacobian @ step == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("free", [False, True])
def test_step_is_the_minimiser_of_the_linear_problem(free: bool) -> None:
    mesh = coarse(300)
    n = len(mesh.cells)
    rng = np.random.default_rng(2)
    jacobian, rhs = rng.standard_normal((40, n + 3)), rng.standard_normal(40)
    image = Laplace().penalty(mesh, jacobian) if free else Diagonal(rng.uniform(1.0, 2.0, n))
    joint = Joint(image, 4.0, others(2))
    x, force = minimiser(joint, jacobian, rhs)
    normal = jacobian.T @ jacobian + joint.matrix
    assert x == pytest.approx(np.linalg.solve(normal, jacobian.T @ rhs), abs=1e-8)
    assert force == pytest.approx(joint.matrix @ x, abs=1e-8)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"alpha": 0.0}, "expected alpha above 0, got 0.0"),
        ({"alpha": np.nan}, "expected alpha above 0"),
        ({"prior": "tikhonov"}, "expected a prior among"),
        ({"prior": np.eye(3)}, r"expected a prior of shape \(\d+, \d+\), got \(3, 3\)"),
        ({"contacts": "some"}, 'expected contacts "fixed", "one" or "each", got "some"'),
        ({"prior": TotalVariation(0.0)}, "expected a smoothing above 0"),
    ],
)
def test_refused(settings: dict[str, Any], message: str) -> None:
    model = ForwardModel(coarse(300), pattern(), 0.01)
    with pytest.raises(ModelError, match=message):
        AbsoluteImaging(model, **{"alpha": 1.0, **settings})(seen())


def test_what_has_no_logarithm() -> None:
    model = ForwardModel(coarse(300), pattern(), 0.01)
    with pytest.raises(ModelError, match="expected a background above 0, got -1"):
        AbsoluteImaging(model, alpha=1.0)(seen(), background=-1.0)
    turned = ForwardModel(coarse(300), pattern(), 0.01 + 0.01j)
    with pytest.raises(ModelError, match="expected real contact impedances"):
        AbsoluteImaging(turned, alpha=1.0)(seen(), background=1.0)


def test_data_of_another_pattern() -> None:
    model = ForwardModel(coarse(300), Pattern.adjacent(16), 0.01)
    with pytest.raises(DataError, match="expected an observation of 208 voltages, got one of 256"):
        AbsoluteImaging(model, alpha=1.0)(seen())


class Bowl:
    """f(x) = x² in one unknown: its minimum is where no step helps, its walls are steep."""

    def at(self, unknowns: FloatArray) -> Bowl:
        found = Bowl()
        found.x = unknowns
        return found

    x: FloatArray

    @property
    def predicted(self) -> FloatArray:
        return np.asarray(self.x**2)

    @property
    def jacobian(self) -> FloatArray:
        return np.diag(2.0 * self.x)


def bowl(target: float, start: float, **settings: Any) -> Descent:
    goal = Goal(Bowl().at, np.array([target]), lambda _: Diagonal(np.array([1e-12])))
    begin = Descent(np.array([start]), np.array([1e-12 * start]), (), "not begun")
    return descend(goal, begin, **{"most": 50, "tolerance": 1e-12, **settings})


def test_a_descent_reaches_the_minimum_and_says_so() -> None:
    found = bowl(4.0, 0.5)
    assert found.unknowns == pytest.approx([2.0])
    assert "limit" not in found.reason
    assert found.force == pytest.approx([2e-12])


def test_where_no_step_helps_it_stops() -> None:
    found = bowl(-1.0, 1e-9)
    assert found.reason == "no step lowers the objective any further"
    assert len(found.steps) == 1


def test_no_step_goes_beyond_its_reach() -> None:
    free, bound = bowl(4.0, 0.01, most=1), bowl(4.0, 0.01, most=1, reach=0.5)
    assert bound.unknowns == pytest.approx([0.51])
    assert free.unknowns > 1.0
    assert bound.reason == "reached the limit of 1 steps"
