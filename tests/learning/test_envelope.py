"""Rows answer most strongly where their electrodes are, and presses tell where that is."""

from __future__ import annotations

import numpy as np
import pytest

from learning.labelled import RADIUS, Floats, places
from tomoskin import ForwardModel, Locator, Pattern, Skin
from tomoskin.learning import label_doubts
from tomoskin.learning.touch.model_fit import model_responses
from tomoskin.learning.touch.per_channel import (
    ChannelMaps,
    Envelope,
    likeliest_envelope,
    rings,
)
from tomoskin.sensing.segment import Region

PATTERN = Pattern.adjacent(8)
ROUND = np.column_stack(
    [f(np.linspace(0, 2 * np.pi, 48, endpoint=False)) for f in (np.cos, np.sin)]
)
RINGS = list(rings(PATTERN, ROUND))


def ring(first: int, way: int) -> Envelope:
    """Electrodes from the angle 2π ``first`` / 32 on, counter-clockwise where ``way`` is 1."""
    return RINGS[2 * first + (way < 0)]


def answers(n: int, seed: int, envelope: Envelope, noise: float = 0.1) -> tuple[Floats, Floats]:
    """Presses on a skin whose rows answer strongly near their electrodes, each in its own way."""
    xy, rng = places(n, seed), np.random.default_rng(99)
    waves, phases = rng.normal(0, 2.5, (2, PATTERN.n_meas)), rng.uniform(0, 7, PATTERN.n_meas)
    uneven = np.cos(xy / RADIUS @ waves + phases)
    dv = envelope(xy / RADIUS) * uneven
    return dv + noise * np.random.default_rng(seed + 1).normal(size=dv.shape), xy


def test_a_response_is_largest_at_its_electrodes() -> None:
    at = RINGS[0](np.array([[0.0, 0.0], [0.95, 0.05], [-0.95, 0.05]]))
    near = (PATTERN.drive == 0).any(axis=1) | (PATTERN.measure == 0).any(axis=1)
    np.testing.assert_allclose(at[0], 1.0, rtol=0.02)
    assert (at[1, near] > 1.2).all()
    assert at[1, near].mean() > 2 * at[2, near].mean()
    assert (Envelope()(np.zeros((3, 2))) == 1).all()


@pytest.mark.parametrize(("first", "way"), [(0, 1), (5, -1), (20, 1)])
def test_presses_tell_where_the_electrodes_are(first: int, way: int) -> None:
    dv, xy = answers(20, 3, ring(first, way))
    found = likeliest_envelope(iter(RINGS), xy / RADIUS, dv)
    assert found is ring(first, way)


def test_presses_that_do_not_tell_it_leave_it_open() -> None:
    dv, xy = answers(20, 3, Envelope())
    assert likeliest_envelope(iter(RINGS), xy / RADIUS, dv).electrodes is None


@pytest.mark.parametrize("n", [8, 20])
def test_few_presses_tell_more_where_the_electrodes_are_known(n: int) -> None:
    envelope = ring(3, 1)
    dv, xy = answers(n, 3, envelope)
    others, there = answers(300, 5, envelope, noise=0.0)
    missed = [
        float(((ChannelMaps.of(xy / RADIUS, dv, one).at(there / RADIUS)[0] - others) ** 2).mean())
        for one in (envelope, Envelope())
    ]
    assert missed[0] < 0.9 * missed[1]


def test_maps_know_how_far_they_may_be_off() -> None:
    envelope = ring(3, 1)
    dv, xy = answers(40, 0, envelope)
    others, there = answers(300, 5, envelope)
    told, variance = ChannelMaps.of(xy / RADIUS, dv, envelope).at(there / RADIUS)
    assert 0.5 < float(((told - others) ** 2 / variance).mean()) < 1.5


def test_a_locator_that_knows_its_pattern_uses_it() -> None:
    others, there = answers(200, 5, ring(3, 1), 0.35)
    missed = np.zeros(2)
    for seed in (0, 10, 20, 30):
        dv, xy = answers(10, seed, ring(3, 1), 0.35)
        for k, pattern in enumerate((PATTERN, None)):
            told = Locator.fit(dv, xy, pattern=pattern).predict(others)[0]
            missed[k] += np.linalg.norm(told - there, axis=1).mean()
    assert missed[0] < 0.99 * missed[1]


@pytest.mark.parametrize(
    ("axes", "signs", "words"),
    [
        ([0, 1], (1, 1), ""),
        ([1, 0], (1, 1), "with x and y exchanged:"),
        ([0, 1], (1, -1), "with y of the other sign:"),
        ([1, 0], (-1, 1), "with x and y exchanged and y of the other sign:"),
    ],
)
def test_labels_on_other_axes_are_said(axes: list[int], signs: tuple[int, int], words: str) -> None:
    skin = Skin.load("textile-disc-8")
    locator = Locator.fit(*_on(skin, axes, signs), skin=skin)
    assert words in label_doubts(locator, skin)
    assert bool(label_doubts(locator, skin)) == bool(words)


def test_labels_in_another_unit_are_said() -> None:
    skin = Skin.load("textile-disc-8")
    dv, xy = _on(skin, [0, 1], (1, 1))
    inches = Locator.fit(dv, xy / 25.4, skin=skin)
    assert "inches" in label_doubts(inches, skin)


@pytest.mark.parametrize("electrodes", [8, 16])
def test_a_sheet_that_answers_as_its_model_says_tells_axes_and_unit(electrodes: int) -> None:
    skin = Skin.load(f"textile-disc-{electrodes}")
    model = ForwardModel(skin.mesh(), skin.pattern(), contact_impedance=skin.contact_impedance)
    region, rng = Region.of(skin), np.random.default_rng(5)
    xy = region.metres(region.grid[rng.choice(len(region.grid), 20, replace=False)])
    dv = model_responses(model, skin.conductivity, xy, region.unit)
    dv += 0.1 * np.abs(dv).mean() * rng.normal(size=dv.shape)

    def said(labels: Floats) -> str:
        return label_doubts(Locator.fit(dv, labels, pattern=skin.pattern(), skin=skin), skin)

    assert said(xy) == ""
    assert "with x and y exchanged:" in said(xy[:, ::-1])
    assert "with x of the other sign:" in said(xy * [-1, 1])
    assert "0.39 times as far from the middle" in said(xy / 2.54)


def test_presses_that_do_not_tell_where_the_electrodes_are_doubt_no_label() -> None:
    skin = Skin.load("textile-disc-8")
    dv, xy = answers(30, 3, Envelope())
    xy *= Region.of(skin).unit / RADIUS
    assert label_doubts(Locator.fit(dv, xy, skin=skin), skin) == ""


def _on(skin: Skin, axes: list[int], signs: tuple[int, int]) -> tuple[Floats, Floats]:
    """Presses on a skin whose labels are on other axes."""
    region = Region.of(skin)
    rim = Envelope.of(skin.pattern(), region.scaled(skin.electrode_centres))
    dv, xy = answers(30, 3, rim)
    return dv, (region.unit / RADIUS * xy)[:, axes] * signs
