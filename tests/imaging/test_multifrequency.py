"""Several frequencies: differences between them, regions, and the Cole model.

Voltages come from another, finer mesh than the images', with noise.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from golden import mismatch
from shapes import disc
from tomoskin.core import ComplexArray, DataError, FloatArray, IntArray, ModelError
from tomoskin.imaging import (
    Cole,
    FrequencyDifference,
    Regions,
    cole_of_regions,
    simple_change,
    weighted_change,
)
from tomoskin.imaging.dispersion import cole
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

FREQUENCIES = np.array([1e3, 5e3, 2e4, 1e5, 5e5])
BACKGROUND = (0.1, 0.3, 3e-6, 0.1)
INCLUSION = (0.4, 0.6, 5e-7, 0.2)
PLACE, RADIUS = (0.03, 0.02), 0.025


@cache
def mesh(cells: int) -> Mesh:
    return disc(8, cells)


@cache
def models(cells: int) -> dict[float, ForwardModel]:
    """With a contact impedance that falls with frequency."""
    return {
        float(f): ForwardModel(
            mesh(cells), Pattern.adjacent(8), 0.001 + 0.01 / (1 + 1j * f / 2e5), 1e-3
        )
        for f in FREQUENCIES
    }


def labels(cells: int) -> IntArray:
    away = np.linalg.norm(mesh(cells).centroids - PLACE, axis=1)
    return np.asarray(away < RADIUS, dtype=np.int64)


def spectrum(parameters: tuple[float, ...]) -> dict[float, complex]:
    return {float(f): complex(cole(np.array(f), *parameters)) for f in FREQUENCIES}


@cache
def voltages(inclusion: tuple[float, ...] = INCLUSION, noise: float = 1e-4) -> dict[float, Any]:
    """Voltages of a sheet with an inclusion, with complex white noise."""
    rng, found = np.random.default_rng(0), {}
    for f, model in models(1300).items():
        gamma = np.array([spectrum(BACKGROUND)[f], spectrum(inclusion)[f]])[labels(1300)]
        v = model.solve(gamma).voltages
        sd = noise * np.sqrt((np.abs(v) ** 2).mean() / 2)
        found[f] = v + sd * (rng.standard_normal(len(v)) + 1j * rng.standard_normal(len(v)))
    return found


def imaging(kind: str = "weighted", **settings: Any) -> FrequencyDifference:
    given: dict[str, Any] = {"reference": 1e3, "alpha": 1e-4, **settings}
    return FrequencyDifference(models(500), spectrum(BACKGROUND), kind=kind, **given)


def contrast(values: FloatArray) -> float:
    """Mean over the inclusion against the rest's root mean square."""
    inside = labels(500) == 1
    return float(abs(values[inside].mean()) / np.sqrt((values[~inside] ** 2).mean()))


# Differences between frequencies.


def test_weighting_shows_what_has_another_spectrum_and_not_the_background() -> None:
    images = imaging()(voltages())
    assert set(images) == set(FREQUENCIES[1:])
    for f in (2e4, 1e5, 5e5):
        size = np.abs(images[f].values)
        place = mesh(500).centroids[size.argmax()]
        assert np.linalg.norm(place - PLACE) < RADIUS, f
        assert contrast(images[f].real.values) > 3, f


def test_the_simple_difference_shows_the_background_instead() -> None:
    simple, weighted = imaging("simple")(voltages()), imaging()(voltages())
    for f in (1e5, 5e5):
        assert contrast(simple[f].real.values) < 0.5 * contrast(weighted[f].real.values), f


def test_simple_is_enough_where_the_background_does_not_change() -> None:
    """The source's case: one sheet, an object that alone knows the frequency."""
    still = {f: ForwardModel(mesh(1300), Pattern.adjacent(8), 0.01, 1e-3) for f in (1e3, 1e5)}
    own = {f: ForwardModel(mesh(500), Pattern.adjacent(8), 0.01, 1e-3) for f in (1e3, 1e5)}
    data = {
        f: m.solve(np.array([0.2, spectrum(INCLUSION)[f]])[labels(1300)]).voltages
        for f, m in still.items()
    }
    imager = FrequencyDifference(
        own, dict.fromkeys(own, 0.2), reference=1e3, kind="simple", alpha=1e-4
    )
    image = imager(data)[1e5]
    peak = mesh(500).centroids[np.abs(image.values).argmax()]
    assert np.linalg.norm(peak - PLACE) < RADIUS
    assert contrast(image.real.values) > 3


def test_the_sign_is_that_of_the_change() -> None:
    """The inclusion gains less than in proportion: both parts of its excess are negative."""
    image = imaging()(voltages())[1e5]
    ratio = spectrum(BACKGROUND)[1e5] / spectrum(BACKGROUND)[1e3]
    start = spectrum(INCLUSION)[1e3] - spectrum(BACKGROUND)[1e3]
    excess = spectrum(INCLUSION)[1e5] - spectrum(BACKGROUND)[1e5] - ratio * start
    mean = image.values[labels(500) == 1].mean()
    assert (np.sign(mean.real), np.sign(mean.imag)) == (np.sign(excess.real), np.sign(excess.imag))


def test_an_object_of_the_backgrounds_spectrum_drops_out() -> None:
    twice = (2 * BACKGROUND[0], 2 * BACKGROUND[1], *BACKGROUND[2:])
    same = imaging()(voltages(twice))[1e5].values
    other = imaging()(voltages())[1e5].values
    assert np.abs(same[labels(500) == 1].mean()) < 0.1 * np.abs(other[labels(500) == 1].mean())


@given(
    scale=st.complex_numbers(min_magnitude=1e-3, max_magnitude=1e3, allow_nan=False),
    seed=st.integers(0, 99),
)
def test_proportional_voltages_leave_nothing(scale: complex, seed: int) -> None:
    rng = np.random.default_rng(seed)
    v = rng.standard_normal(20) + 1j * rng.standard_normal(20)
    assert np.abs(weighted_change(scale * v, v)).max() < 1e-12 * np.abs(scale * v).max()
    assert simple_change(v, v).any() == np.False_


def test_no_voltages_at_the_reference() -> None:
    with pytest.raises(DataError, match="voltages at the reference frequency are zero"):
        weighted_change(np.ones(3), np.zeros(3))


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"reference": 2e3}, "a model at the reference of 2000 Hz, got none"),
        ({"kind": "absolute"}, 'among simple, weighted, got "absolute"'),
        ({"alpha": 0.0}, "alpha above 0"),
        ({"models": {1e3: None}}, "at least 2 frequencies, got 1"),
        ({"models": {-1.0: None, 1e3: None}}, "frequencies above 0 Hz, got -1.0"),
        ({"admittivity": {1e3: 1.0}}, "admittivity at 5000 Hz, got none"),
        ({"mixed": True}, "one mesh and one pattern"),
    ],
)
def test_refused(settings: dict[str, Any], message: str) -> None:
    chosen: dict[float, ForwardModel] = dict(models(500))
    if settings.pop("mixed", False):
        chosen[5e3] = models(1300)[5e3]
    if "models" in settings:
        chosen = {f: models(500)[1e3] for f in settings.pop("models")}
    rest = {"admittivity": spectrum(BACKGROUND), "reference": 1e3, "alpha": 1e-4, **settings}
    with pytest.raises(ModelError, match=message):
        FrequencyDifference(chosen, **rest)


def test_data_that_do_not_fit_name_their_frequency() -> None:
    with pytest.raises(DataError, match="expected voltages at 5000 Hz, got none"):
        imaging()({1e3: np.ones(40)})
    with pytest.raises(DataError, match=r"20000 Hz: .*shape \(40,\), got \(39,\)"):
        imaging()({**voltages(), 2e4: np.ones(39)})


# Regions.


def test_regions_of_the_same_mesh_come_back() -> None:
    truth = np.array([0.2 + 0.05j, 0.5 + 0.01j])
    model = models(500)[1e5]
    found = Regions.fit(model, model.solve(truth[labels(500)]).voltages, labels(500), 1.0)
    assert found.values == pytest.approx(truth, rel=1e-8)
    assert found.misfit < 1e-10


def test_real_voltages_give_real_regions() -> None:
    model = ForwardModel(mesh(500), Pattern.adjacent(8), 0.01)
    found = Regions.fit(model, model.solve(0.7).voltages, np.zeros(len(mesh(500).cells), int))
    assert found.values.dtype == np.float64
    assert found.values == pytest.approx([0.7])


def test_the_deviation_of_a_region_is_what_noise_makes_of_it() -> None:
    """Forty noisy repeats: their spread is known to 11 %."""
    truth, rng, model = np.array([0.2, 0.5]), np.random.default_rng(4), models(500)[1e5]
    clean = model.solve(truth[labels(500)]).voltages
    sd = 1e-3 * np.abs(clean).mean()
    fits = []
    for _ in range(40):
        noise = sd * (rng.standard_normal(40) + 1j * rng.standard_normal(40)) / np.sqrt(2)
        fits.append(Regions.fit(model, clean + noise, labels(500), 0.2))
    spread = np.std([fit.values for fit in fits], axis=0)
    said = np.sqrt(np.mean([np.diag(fit.covariance).real for fit in fits], axis=0))
    assert said == pytest.approx(spread, rel=0.4)


@pytest.mark.parametrize("wrong", ["nothing", "reversed"])
def test_voltages_of_no_such_sheet(wrong: str) -> None:
    model = ForwardModel(mesh(500), Pattern.adjacent(8), 0.01)
    v = model.solve(np.array([0.2, 0.5])[labels(500)]).voltages
    with pytest.raises(ModelError, match="no admittivities fit the voltages"):
        Regions.fit(model, {"nothing": 0 * v, "reversed": -v}[wrong], labels(500))


@pytest.mark.parametrize(
    ("given_labels", "data", "message"),
    [
        (np.zeros(3, int), np.ones(40), "labels: expected a whole number for each of"),
        (None, np.ones(39), r"voltages of shape \(40,\), got \(39,\)"),
        (None, np.full(40, np.nan), "expected finite voltages"),
        ("float", np.ones(40), "labels: expected a whole number"),
        ("negative", np.ones(40), "labels: expected regions from 0, got -1"),
        ("gap", np.ones(40), "labels: region 1 has no cell"),
        ("many", np.ones(40), "40 voltages are too few to estimate"),
    ],
)
def test_impossible_regions(given_labels: Any, data: FloatArray, message: str) -> None:
    n = len(mesh(500).cells)
    made = {
        "float": np.zeros(n),
        "negative": np.full(n, -1),
        "gap": np.where(np.arange(n) > 9, 2, 0),
        "many": np.arange(n),
    }
    if given_labels is None:
        table = np.zeros(n, int)
    else:
        table = made[given_labels] if isinstance(given_labels, str) else given_labels
    with pytest.raises(DataError, match=message):
        Regions.fit(models(500)[1e3], data, table)


# The Cole model.


@settings(max_examples=25)
@given(
    low=st.floats(0.01, 1.0),
    gain=st.floats(1.5, 10.0),
    relaxation=st.floats(3e3, 3e5),
    alpha=st.floats(0.0, 0.6),
)
def test_exact_data_give_the_parameters_back(
    low: float, gain: float, relaxation: float, alpha: float
) -> None:
    truth = (low, gain * low, 1 / (2 * np.pi * relaxation), alpha)
    f = np.geomspace(1e2, 1e7, 11)
    found = Cole.fit(f, cole(f, *truth))
    parameters = (found.low, found.high, found.time_constant)
    assert parameters == pytest.approx(truth[:3], rel=1e-3)
    assert found.alpha == pytest.approx(alpha, abs=1e-3)
    assert mismatch(found(f), cole(f, *truth)) < 1e-5


def test_limits_of_the_formula() -> None:
    ends = cole(np.array([1e-9, 1e15]), *BACKGROUND)
    assert ends == pytest.approx([0.1, 0.3], rel=1e-3)
    half = cole(np.array([1 / (2 * np.pi * 3e-6)]), 0.1, 0.3, 3e-6, 0.0)
    assert half == pytest.approx([0.2 + 0.1j])  # Debye at its relaxation


@pytest.mark.slow
def test_the_deviations_are_what_noise_makes_of_the_parameters() -> None:
    rng, f = np.random.default_rng(5), np.geomspace(1e3, 1e6, 9)
    clean, sd = cole(f, *BACKGROUND), 1e-3
    fits = [
        Cole.fit(f, clean + sd * (rng.standard_normal(9) + 1j * rng.standard_normal(9)), given)
        for given in 60 * [np.full(9, sd)]
    ]
    table = np.array([(c.low, c.high, c.time_constant, c.alpha) for c in fits])
    said = np.mean([c.sd for c in fits], axis=0)
    assert table.std(axis=0) == pytest.approx(said, rel=0.35)
    assert (np.abs(table.mean(axis=0) - BACKGROUND) < 4 * said / np.sqrt(60)).all()


def test_without_deviations_they_come_from_the_misfit() -> None:
    rng, f = np.random.default_rng(6), np.geomspace(1e3, 1e6, 40)
    noisy = cole(f, *BACKGROUND) + 1e-3 * (rng.standard_normal(40) + 1j * rng.standard_normal(40))
    free, given = Cole.fit(f, noisy), Cole.fit(f, noisy, np.full(40, 1e-3))
    assert free.sd == pytest.approx(given.sd, rel=0.25)


def test_no_dispersion_has_no_time_constant() -> None:
    """Whatever the fit says of τ, it must not claim to know it."""
    found = Cole.fit(FREQUENCIES, np.full(5, 0.2 + 0j), np.full(5, 1e-3))
    assert found(FREQUENCIES) == pytest.approx(np.full(5, 0.2), abs=1e-6)
    assert not found.sd[2] < found.time_constant


def test_the_order_of_the_frequencies_does_not_matter() -> None:
    values = cole(FREQUENCIES, *BACKGROUND)
    back = Cole.fit(FREQUENCIES[::-1], values[::-1])
    assert back.low == pytest.approx(Cole.fit(FREQUENCIES, values).low)


@pytest.mark.parametrize(
    ("frequency", "values", "sd", "message"),
    [
        ([1e3, 1e4], [1, 1], None, "at least 3 frequencies .* got 2"),
        ([1e3, 1e4, 1e5], [1, 1], None, "as many frequencies as values"),
        ([1e3, 1e4, 0.0], [1, 1, 1], None, "frequencies above 0 Hz"),
        ([1e3, 1e4, 1e4], [1, 1, 1], None, "each frequency once"),
        ([1e3, 1e4, 1e5], [1, np.nan, 1], None, "finite admittivities"),
        ([1e3, 1e4, 1e5], [1, -1, 1], None, "conductivity above 0"),
        ([1e3, 1e4, 1e5], [1, 1, 1], [1, 1], r"expected 3 deviations, got shape \(2,\)"),
        ([1e3, 1e4, 1e5], [1, 1, 1], [1, 1, 0], "deviations above 0"),
    ],
)
def test_what_cannot_be_fitted(frequency: Any, values: Any, sd: Any, message: str) -> None:
    with pytest.raises(DataError, match=message):
        Cole.fit(frequency, values, sd)


def test_dispersions_of_regions_from_noisy_voltages_of_another_mesh() -> None:
    """Background to 3 %; the inclusion, of which 40 rows see little, to 15 %."""
    found = cole_of_regions(models(500), voltages(), labels(500), 0.2)
    for got, truth, rel in zip(found, (BACKGROUND, INCLUSION), (0.03, 0.15), strict=True):
        assert (got.low, got.high) == pytest.approx(truth[:2], rel=rel)
        assert got.time_constant == pytest.approx(truth[2], rel=5 * rel)
        assert got.alpha == pytest.approx(truth[3], abs=0.15)


def test_regions_at_too_few_frequencies() -> None:
    two = {f: models(500)[f] for f in (1e3, 5e3)}
    with pytest.raises(DataError, match="at least 3 frequencies"):
        cole_of_regions(two, voltages(), labels(500))
    data: dict[float, ComplexArray] = {1e3: voltages()[1e3]}
    with pytest.raises(DataError, match="voltages at 5000 Hz, got none"):
        cole_of_regions(models(500), data, labels(500))
