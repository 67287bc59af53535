"""Conductivity from strain and its past: laws, steps of any length, remainders."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tomoskin.core import ModelError
from tomoskin.twin import MaterialSettings, TwinSettings
from tomoskin.twin.material import MaterialState, advance, conductivity, spread_over

TEXTILE = TwinSettings.preset("textile").material
PLAIN = MaterialSettings()
UNLOADED = np.array([1.25, 1.25])


def loaded(strain, depth=0.0):
    return np.array([(*strain, depth), (0.0, 0.0, 0.0, 0.0)]).T


REST = np.zeros((4, 2))


def after(settings, *steps):
    state = MaterialState.fresh(settings, 2)
    for load, dt in steps:
        state = advance(state, settings, load, dt)
    return state


def response(settings, *steps):
    """−ln σ/σ₀ of the first cell."""
    sigma = conductivity(after(settings, *steps), settings, UNLOADED)
    if sigma.ndim == 3:
        sigma = np.sqrt(np.linalg.det(sigma))
    return -math.log(sigma[0] / UNLOADED[0])


def test_a_sheet_without_memory():
    pulled = loaded((0.02, 0.01, 0.0))
    assert response(PLAIN, (pulled, 0.0)) == pytest.approx(PLAIN.gauge * 0.015)
    assert response(PLAIN, (pulled, 5.0), (REST, 0.0)) == 0.0


def test_compression_makes_conduct_better_and_a_gel_thinner():
    pressed = loaded((0, 0, 0), 1e-3)
    squeezed = 1e-3 / PLAIN.thickness
    knit = replace(PLAIN, compression=0.05)
    assert response(knit, (pressed, 0.0)) == pytest.approx(-math.log(1 + 0.05 * squeezed))
    gel = TwinSettings.preset("hydrogel").material
    sigma = conductivity(after(gel, (loaded((0, 0, 0), 1.0), 0.0)), gel, UNLOADED)
    assert 0 < sigma[0] < 0.02 * UNLOADED[0]


@given(st.tuples(*[st.floats(-0.2, 0.2)] * 3))
def test_a_directed_sheet_has_a_tensor_along_the_strain(strain):
    settings = replace(PLAIN, gauge_across=5.0)
    sigma = conductivity(after(settings, (loaded(strain), 0.0)), settings, UNLOADED)
    xx, yy, xy = strain
    mean = (xx + yy) / 2
    deviator = np.array([[xx - mean, xy], [xy, yy - mean]])
    values, vectors = np.linalg.eigh(-5.0 * deviator)
    expected = vectors @ np.diag(np.exp(values)) @ vectors.T
    expected *= UNLOADED[0] * math.exp(-settings.gauge * mean)
    assert sigma[0] == pytest.approx(expected, rel=1e-9, abs=1e-12)
    assert np.linalg.eigvalsh(sigma).min() > 0


def test_stretched_one_way_it_conducts_worse_that_way():
    sigma = conductivity(after(TEXTILE, (loaded((0.05, 0.0, 0.0)), 0.0)), TEXTILE, UNLOADED)
    assert sigma[0, 0, 0] < sigma[0, 1, 1] < UNLOADED[0]
    assert sigma[1] == pytest.approx(UNLOADED[1] * np.eye(2))


def told(settings, steps):
    """The settings' laws cell by cell and part by part, as they are written."""
    late, lag, worn, before = [0.0, 0.0], 0.0, 0.0, np.zeros(4)
    for load, dt in steps:
        felt = load[:, 0] / [1, 1, 1, settings.thickness]
        worn += max((felt[:2] - before[:2]).sum() / 2, 0.0)
        before, slack = felt, lag - felt
        size = math.sqrt((slack[0] ** 2 + slack[1] ** 2) / 2 + slack[2] ** 2)
        (part,), (width,) = settings.play, settings.play_widths
        kept = np.array([min(1.0, width / size)] * 3 + [min(1.0, width / abs(slack[3]))])
        lag = felt + slack * kept
        prompt = (1 - part) * felt + part * lag
        late = [
            prompt + (q - prompt) * math.exp(-dt / tau)
            for q, tau in zip(late, settings.creep_times, strict=True)
        ]
    xx, yy, xy, squeezed = 0.93 * prompt + 0.04 * late[0] + 0.03 * late[1]
    mean = (xx + yy) / 2
    values, vectors = np.linalg.eigh(-5.0 * np.array([[xx - mean, xy], [xy, yy - mean]]))
    level = math.exp(-settings.gauge * mean - settings.wear * worn) * (1 + 0.05 * squeezed)
    return level * vectors @ np.diag(np.exp(values)) @ vectors.T


@given(st.integers(0, 2**32 - 1))
def test_the_textile_as_its_laws_are_written(seed):
    random = np.random.default_rng(seed)
    steps = [
        (loaded(tuple(random.uniform(-0.05, 0.1, 3)), random.uniform(0, 1e-3)), dt)
        for dt in random.uniform(0, 3, 5)
    ]
    worn = replace(TEXTILE, wear=0.5)
    sigma = conductivity(after(worn, *steps), worn, UNLOADED)
    assert sigma[0] == pytest.approx(UNLOADED[0] * told(worn, steps), rel=1e-12, abs=1e-14)


@given(st.lists(st.floats(0.0, 5.0), min_size=1, max_size=6))
def test_one_long_step_is_many_short_ones(lengths):
    pulled = loaded((0.02, 0.01, 0.003), 1e-3)
    many = after(TEXTILE, *[(pulled, dt) for dt in lengths])
    one = after(TEXTILE, (pulled, sum(lengths)))
    assert many.memory.late == pytest.approx(one.memory.late, abs=1e-12)
    assert many.worn == pytest.approx(one.worn)


def test_creep_grows_under_load_and_leaves_a_remainder_that_goes():
    settings = replace(PLAIN, creep=(0.2,), creep_times=(3.0,))
    pulled = loaded((0.02, 0.02, 0.0))
    whole = PLAIN.gauge * 0.02
    assert response(settings, (pulled, 0.0)) == pytest.approx(0.8 * whole)
    assert response(settings, (pulled, 3.0)) == pytest.approx((1 - 0.2 / math.e) * whole)
    left = 0.2 * (1 - math.exp(-2)) * whole
    assert response(settings, (pulled, 6.0), (REST, 0.0)) == pytest.approx(left)
    assert response(settings, (pulled, 6.0), (REST, 6.0)) == pytest.approx(left * math.exp(-2))


def test_play_is_a_loop_that_time_does_not_change():
    settings = replace(PLAIN, play=(0.3,), play_widths=(0.004,))

    def at(*strains, dt=0.0):
        return response(settings, *[(loaded((s, s, 0.0)), dt) for s in strains]) / PLAIN.gauge

    assert at(0.02) == pytest.approx(0.7 * 0.02 + 0.3 * 0.016)
    assert at(0.02, 0.01) == pytest.approx(0.7 * 0.01 + 0.3 * 0.014)
    assert at(0.01) == pytest.approx(0.7 * 0.01 + 0.3 * 0.006)  # lower on the way up
    assert at(0.02, 0.0) == pytest.approx(0.3 * 0.004)
    assert at(0.02, 0.0, dt=100.0) == pytest.approx(0.3 * 0.004)
    assert at(0.003, 0.0) == 0.0  # too little to move the play


def test_play_knows_no_direction():
    settings = replace(PLAIN, gauge_across=5.0, play=(0.3,), play_widths=(0.004,))
    along, turned = (0.02, 0.0, 0.0), (0.01, 0.01, 0.01)  # by 45 degrees
    left = [response(settings, (loaded(s), 0.0), (REST, 0.0)) for s in (along, turned)]
    assert left[0] == pytest.approx(left[1])
    assert left[0] > 0


def test_the_textiles_loop_is_that_of_a_knit():
    """Half-way up and down again, at the strain under a press of 4 N and 15 mm."""
    whole, half = loaded((0.023, 0.023, 0.0)), loaded((0.0115, 0.0115, 0.0))
    up = response(TEXTILE, (half, 0.0))
    down = response(TEXTILE, (whole, 0.0), (half, 0.0))
    assert (down - up) / response(TEXTILE, (whole, 0.0)) == pytest.approx(0.125, abs=0.01)


def test_the_textiles_creep_goes_and_its_plays_remainder_stays():
    pulled = loaded((0.02, 0.02, 0.0))
    at_once = response(TEXTILE, (pulled, 5.0), (REST, 0.0))
    later = response(TEXTILE, (pulled, 5.0), (REST, 300.0))
    (part,), (width,) = TEXTILE.play, TEXTILE.play_widths
    assert later == pytest.approx(TEXTILE.gauge * part * width, rel=0.02)
    assert at_once > 1.1 * later


def test_wear_adds_up_over_presses():
    settings = replace(PLAIN, wear=0.1)
    pulled = loaded((0.02, 0.02, 0.0))
    twice = ((pulled, 1.0), (REST, 1.0), (pulled, 1.0), (REST, 1.0))
    assert response(settings, *twice[:2]) == pytest.approx(0.1 * 0.02)
    assert response(settings, *twice) == pytest.approx(0.2 * 0.02)
    held = ((pulled, 1.0), (pulled, 1.0), (REST, 1.0))
    assert response(settings, *held) == pytest.approx(0.1 * 0.02)


def test_temperature_wanders_with_its_deviation_and_memory():
    settings = replace(
        PLAIN, temperature_coefficient=0.004, temperature_sd=2.0, temperature_time=10.0
    )
    random = np.random.default_rng(5)
    state, seen = MaterialState.fresh(settings, 2), []
    for chance in random.standard_normal(20_000):
        state = advance(state, settings, REST, 5.0, float(chance))
        seen.append(state.warmer)
    assert np.std(seen) == pytest.approx(2.0, rel=0.06)
    assert np.corrcoef(seen[:-1], seen[1:])[0, 1] == pytest.approx(math.exp(-0.5), abs=0.03)
    warm = replace(state, warmer=10.0)
    assert conductivity(warm, settings, UNLOADED) == pytest.approx(UNLOADED / 1.04)


def test_the_spread_is_a_smooth_field_with_its_deviation():
    settings = replace(PLAIN, spread=0.1, spread_length=0.02)
    random = np.random.default_rng(3)
    points = np.array([[0.0, 0.0], [0.02, 0.0], [0.2, 0.0]])
    fields = np.log([spread_over(settings, points, random) for _ in range(3000)])
    assert fields.std(axis=0) == pytest.approx([0.1] * 3, rel=0.06)
    assert np.exp(fields).mean() == pytest.approx(1.0, abs=0.005)
    correlation = np.corrcoef(fields.T)
    assert correlation[0, 1] == pytest.approx(math.exp(-0.5), abs=0.05)
    assert correlation[0, 2] == pytest.approx(0.0, abs=0.06)
    assert (spread_over(PLAIN, points, random) == 1.0).all()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"spread": -0.1}, "spread of 0 or more"),
        ({"creep": (0.1,)}, "as many creep as creep_times"),
        ({"creep": (0.1,), "creep_times": (0.0,)}, "creep_times above 0"),
        ({"creep": (0.7, 0.7), "creep_times": (1.0, 2.0)}, "a sum of 1"),
        ({"play": (-0.1,), "play_widths": (1.0,)}, "from 0 to a sum of 1"),
        ({"thickness": 0.0}, "thickness above 0"),
    ],
)
def test_impossible_settings(change, said):
    with pytest.raises(ModelError, match=said):
        replace(PLAIN, **change)


@pytest.mark.parametrize("settings", [PLAIN, TEXTILE], ids=["scalar", "tensor"])
def test_a_needle_does_not_cut_the_sheet(settings):
    sigma = conductivity(after(settings, (loaded((1e4, -3e3, 2e3), 1.0), 1.0)), settings, UNLOADED)
    assert np.isfinite(sigma).all()
    principal = np.linalg.eigvalsh(sigma) if sigma.ndim == 3 else sigma
    assert principal.min() > 0


@pytest.mark.parametrize("dt", [-0.1, math.nan, math.inf])
def test_impossible_steps(dt):
    with pytest.raises(ModelError, match="time step of 0 s or more"):
        advance(MaterialState.fresh(PLAIN, 2), PLAIN, REST, dt)
