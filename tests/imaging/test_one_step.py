"""The one-step operator: what it solves, in both of its forms, and what it refuses."""

from __future__ import annotations

import pickle
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

from golden import mismatch
from shapes import box, disc
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.imaging import LinearProblem, OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern
from tomoskin.model.prior import PRIORS, penalty_of
from tomoskin.sensing.signal import difference

ALPHA = 0.05


@cache
def model() -> ForwardModel:
    return ForwardModel(disc(8), Pattern.adjacent(8), np.geomspace(0.005, 0.02, 8), current=0.1)


def sigma() -> FloatArray:
    return np.random.default_rng(0).uniform(0.5, 2.0, len(model().mesh.cells))


def by_the_book(jacobian: FloatArray, w: FloatArray, q: FloatArray, alpha: float) -> FloatArray:
    """(JᴴWJ + α²Q)⁻¹JᴴW, by a general solver."""
    q = np.diag(q) if q.ndim == 1 else q
    weighted = jacobian.conj().T * w
    return np.asarray(np.linalg.solve(weighted @ jacobian + alpha**2 * q, weighted))


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("kind", ["plain", "normalised"])
@pytest.mark.parametrize("weighted", [False, True])
def test_matrix_is_that_of_the_formula(prior: str, kind: str, weighted: bool) -> None:
    state = model().at(sigma())
    v, jacobian = state.voltages, state.jacobian
    w = np.ones(len(v))
    if kind == "normalised":
        jacobian, w = jacobian / np.abs(v)[:, None], v**2
    if weighted:
        w = np.random.default_rng(1).uniform(0.1, 1.0, len(v))
    operator = OneStep(
        model(),
        prior,
        alpha=ALPHA,
        conductivity=sigma(),
        difference=kind,
        weights=w if weighted else None,
    )
    q = penalty_of(prior, model().mesh, jacobian).matrix
    assert mismatch(operator.matrix, by_the_book(jacobian, w, q, ALPHA)) < 1e-7
    assert np.array_equal(operator.reference, v)


@pytest.mark.parametrize("form", ["diagonal", "dense", "sparse"])
def test_a_prior_may_come_as_diagonal_dense_or_sparse(form: str) -> None:
    q = np.random.default_rng(2).uniform(0.5, 2.0, len(model().mesh.cells))
    given: Any = {"diagonal": q, "dense": np.diag(q), "sparse": csr_array(diags_array(q))}[form]
    operator = OneStep(model(), given, alpha=ALPHA)
    expected = by_the_book(model().jacobian(1.0), np.ones(40), q, ALPHA)
    assert mismatch(operator.matrix, expected) < 1e-9


@pytest.mark.parametrize("prior", PRIORS)
def test_a_change_shows_with_its_sign_at_its_place(prior: str) -> None:
    """Real voltages of a soft spot, not linearised ones."""
    place = np.array([0.04, 0.03])
    inside = np.linalg.norm(model().mesh.centroids - place, axis=1) < 0.025
    operator = OneStep(model(), prior, alpha=1e-4, conductivity=2.0)
    change = model().solve(np.where(inside, 1.6, 2.0)).voltages - operator.reference
    image = operator(change)
    weight = np.where(image.values < 0.6 * image.values.min(), image.values, 0.0)
    weight *= model().mesh.volumes
    centre = weight @ model().mesh.centroids / weight.sum()
    assert np.linalg.norm(centre - place) < 0.016
    assert -0.8 < image.values.min() < -0.05


def test_small_alpha_explains_the_data() -> None:
    operator = OneStep(model(), "identity", alpha=1e-9)
    dv = model().jacobian(1.0) @ np.random.default_rng(3).standard_normal(operator.matrix.shape[0])
    # 40 rows, half of them reciprocal: what the model can say, the image says again
    assert mismatch(model().jacobian(1.0) @ operator(dv).values, dv) < 1e-4


def test_large_alpha_shows_nothing() -> None:
    sizes = [np.abs(OneStep(model(), alpha=a).matrix).max() for a in (1e-3, 1e0, 1e3)]
    assert sizes[0] > sizes[1] > 1e5 * sizes[2]


def test_normalised_image_is_blind_to_the_read_outs_gain() -> None:
    operator = OneStep(model(), alpha=ALPHA, difference="normalised")
    reference = operator.reference * np.random.default_rng(4).uniform(0.9, 1.1, 40)
    values = reference * np.random.default_rng(5).uniform(0.99, 1.01, 40)
    images = [operator(difference(g * values, g * reference, "normalised")) for g in (1.0, 250.0)]
    assert images[0].values == pytest.approx(images[1].values, rel=1e-9)


def test_a_deferred_image_is_the_image_to_single_precision() -> None:
    operator = OneStep(ForwardModel(disc(), Pattern.adjacent(8), 0.01), alpha=0.1)
    dv = np.random.default_rng(2).normal(0.0, 1e-4, operator.matrix.shape[1])
    exact, deferred = operator(dv), operator.deferred(dv)
    assert mismatch(deferred.values, exact.values) < 1e-5
    assert (deferred.unit, deferred.mesh_id) == (exact.unit, exact.mesh_id)


def test_a_deferred_image_is_computed_once_when_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    operator = OneStep(ForwardModel(disc(), Pattern.adjacent(8), 0.01), alpha=0.1)
    dv = np.random.default_rng(2).normal(0.0, 1e-4, operator.matrix.shape[1])
    values, compute = operator.deferred(dv).values, OneStep._quick_values
    asked: list[int] = []

    def counted(self: OneStep, checked: FloatArray) -> FloatArray:
        asked.append(len(checked))
        return compute(self, checked)

    monkeypatch.setattr(OneStep, "_quick_values", counted)
    image = operator.deferred(dv)
    assert not asked
    np.testing.assert_array_equal(image.values, values)
    assert image.values is image.values
    assert len(asked) == 1
    again = pickle.loads(pickle.dumps(image))
    np.testing.assert_array_equal(again.values, values)
    assert (again.unit, again.mesh_id) == (image.unit, image.mesh_id)
    with pytest.raises(DataError, match="not"):
        operator.deferred(np.full_like(dv, np.nan))


def test_image_names_its_mesh_and_unit() -> None:
    image = OneStep(model(), alpha=ALPHA)(np.zeros(40))
    assert (image.unit, image.mesh_id) == ("S", model().mesh.identity)
    bar = box(np.linspace(0, 1, 4), np.linspace(0, 1, 3), np.linspace(0, 1, 3))
    ends = Pattern.from_tables([[1, 0]], [[1, 0]])
    assert OneStep(ForwardModel(bar, ends, 0.1), alpha=1.0)(np.ones(1)).unit == "S/m"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"alpha": 0.0}, "expected alpha above 0, got 0.0"),
        ({"alpha": -1.0}, "expected alpha above 0"),
        ({"alpha": np.nan}, "expected alpha above 0"),
        ({"alpha": np.inf}, "expected alpha above 0"),
        ({"prior": "tikhonov"}, "among identity, .*matern, got .tikhonov"),
        ({"prior": np.ones(3)}, r"expected a prior of shape \(\d+, \d+\), got \(3,\)"),
        ({"prior": np.eye(3)}, r"expected a prior of shape \(\d+, \d+\), got \(3, 3\)"),
        ({"difference": "relative"}, 'expected difference "plain" or "normalised"'),
        ({"weights": np.ones(39)}, r"expected weights of shape \(40,\), got \(39,\)"),
        ({"weights": np.r_[np.ones(39), 0.0]}, "row 39: expected weights above 0, got 0.0"),
        ({"weights": np.r_[np.nan, np.ones(39)]}, "row 0: expected weights above 0, got nan"),
        ({"conductivity": 0.0}, "cell 0: expected a positive finite conductivity"),
        ({"conductivity": np.ones((len(disc(8).cells), 2, 2)) + np.eye(2)}, "got tensors"),
    ],
)
def test_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ModelError, match=message):
        OneStep(model(), **{"alpha": ALPHA, **settings})


@pytest.mark.parametrize("value", [0.0, -1.0])
def test_a_diagonal_prior_must_be_positive(value: float) -> None:
    q = np.ones(len(model().mesh.cells))
    q[11] = value
    with pytest.raises(ModelError, match="positive diagonal") as caught:
        OneStep(model(), q, alpha=ALPHA)
    assert caught.value.where == "prior, cell 11"


@pytest.mark.parametrize("diagonal", [True, False])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_prior_must_be_finite(diagonal: bool, value: float) -> None:
    q = np.ones(len(model().mesh.cells))
    q[11] = value
    with pytest.raises(ModelError, match="expected finite numbers") as caught:
        OneStep(model(), q if diagonal else np.diagflat(q), alpha=ALPHA)
    assert caught.value.where == "prior, cell 11"


def test_a_prior_that_makes_no_minimum() -> None:
    q = np.eye(len(model().mesh.cells))
    q[3, 3] = -1e6
    with pytest.raises(ModelError, match="not positive definite"):
        OneStep(model(), q, alpha=ALPHA)


@pytest.mark.parametrize("prior", PRIORS)
@pytest.mark.parametrize("kind", ["plain", "normalised"])
def test_complex_data_are_inverted_alike(prior: str, kind: str) -> None:
    turned = ForwardModel(model().mesh, model().pattern, 0.01 + 0.01j)
    operator = OneStep(turned, prior, alpha=ALPHA, conductivity=1.0 + 0.2j, difference=kind)
    state = turned.at(1.0 + 0.2j)
    size = np.abs(state.voltages) if kind == "normalised" else np.ones(40)
    jacobian = state.jacobian / size[:, None]
    q = penalty_of(prior, turned.mesh, jacobian).matrix
    expected = by_the_book(jacobian, size**2, q, ALPHA)
    assert np.iscomplexobj(expected)
    assert mismatch(operator.matrix, expected) < 1e-7


def test_complex_data_through_a_real_operator_are_two_images() -> None:
    operator = OneStep(model(), alpha=ALPHA)
    real, imaginary = tuple(np.random.default_rng(6).standard_normal((2, 40)))
    for image in (operator, operator.deferred):
        expected = image(real).values + 1j * image(imaginary).values
        assert mismatch(image(real + 1j * imaginary).values, expected) < 1e-6


@pytest.mark.parametrize("shape", [(39,), (41,), (1, 41), (1, 1, 40), ()])
def test_data_of_another_length(shape: tuple[int, ...]) -> None:
    with pytest.raises(DataError, match=r"difference data of shape \(40,\), got"):
        OneStep(model(), alpha=ALPHA)(np.zeros(shape))


def test_many_frames_are_imaged_at_once() -> None:
    operator = OneStep(model(), alpha=ALPHA)
    dv = np.random.default_rng(2).standard_normal((5, 40))
    images = operator(dv)
    assert images.values.shape == (5, len(model().mesh.cells))
    for one, values in zip(dv, images.values, strict=True):
        assert mismatch(values, operator(one).values) < 1e-12
    dv[3, 7] = np.nan
    with pytest.raises(DataError, match=r"rows \[7\] are not"):
        operator(dv)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_data_that_are_not_finite_are_named(value: float) -> None:
    dv = np.zeros(40)
    dv[[4, 17]] = value
    with pytest.raises(DataError, match=r"rows \[4, 17\] are not"):
        OneStep(model(), alpha=ALPHA)(dv)


def test_a_voltage_that_is_zero_by_symmetry_cannot_be_normalised_by() -> None:
    """A square driven from side to side: the two other sides are at the same potential."""
    points = [[-1, -1], [1, -1], [1, 1], [-1, 1], [0, 0]]
    sides = [[0, 1], [1, 2], [2, 3], [3, 0]]
    cells = np.array([[*side, 4] for side in sides])
    square = Mesh(np.array(points, float), cells, tuple(np.array([side]) for side in sides))
    pattern = Pattern.from_tables([[0, 2], [0, 2]], [[1, 3], [0, 2]])
    model = ForwardModel(square, pattern, 0.1)
    with pytest.raises(ModelError, match=r"row 0: .*too little to divide by"):
        OneStep(model, alpha=0.1, difference="normalised")
    assert OneStep(model, alpha=0.1).matrix.shape == (4, 2)


def test_a_noisy_row_loses_its_say() -> None:
    """With ever more noise on some rows the operator becomes the one without them."""
    problem, rows = LinearProblem.of(model(), "laplace"), [3, 17]
    weights = np.ones(40)
    weights[rows] = 1e-12
    nearly = LinearProblem.of(model(), "laplace", weights=weights).operator(0.1)
    assert mismatch(nearly.matrix, problem.operator(0.1).without(rows).matrix) < 1e-6
