"""Touches everywhere, without labels: where they were, how sure that is, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from learning.labelled import Floats, held
from tomoskin import ForwardModel, Pattern, Skin
from tomoskin.core import DataError
from tomoskin.extras.alignment import Rubbing

TOUCHES = 200


@cache
def skin() -> Skin:
    return Skin.load("textile-disc-8").altered({"mesh": {"cells": 800}})


@cache
def jacobian() -> Floats:
    sheet = skin()
    model = ForwardModel(sheet.mesh(), sheet.pattern(), contact_impedance=sheet.contact_impedance)
    return model.jacobian(sheet.conductivity)


def touches(n: int, seed: int, side: float = -1.0) -> tuple[Floats, Floats]:
    """Changes at random positions of x > ``side`` radii; channels have gains that nobody knows."""
    rng, radius = np.random.default_rng(seed), 0.1
    spots = rng.uniform(-radius, radius, (12 * n, 2))
    spots = spots[(np.hypot(*spots.T) < radius) & (spots[:, 0] > side * radius)][:n]
    away = ((spots[:, None] - skin().mesh().centroids) ** 2).sum(axis=2)
    force = rng.uniform(0.6, 1.4, (n, 1))
    dv = force * np.exp(-0.5 * away / 0.012**2) @ jacobian().T
    gains = np.exp(0.5 * np.random.default_rng(99).normal(size=dv.shape[1]))
    dv *= gains
    return dv + 0.01 * np.median(np.abs(dv)) * rng.normal(size=dv.shape), spots


@cache
def rubbed() -> Rubbing:
    return Rubbing.of(touches(TOUCHES, 0)[0], skin())


def missed(found: Rubbing, xy: Floats) -> Floats:
    return np.asarray(found.presses.xy - xy)


def recorded(path: Path, count: int) -> tuple[Floats, Floats, Pattern]:
    with np.load(path) as kept:
        order = np.random.default_rng(31).permutation(len(kept["dv"]))[:count]
        dv, xy = kept["dv"][order].astype(float), 1e-3 * kept["xy_mm"][order]
        return dv, xy, Pattern.from_tables(kept["inj"], kept["meas"])


def hydrogel(first: str) -> Skin:
    electrodes = {"width": "3 mm", "first": first, "order": "counter-clockwise"}
    changes = {"outline": {"diameter": "80 mm"}, "electrodes": electrodes}
    return Skin.load("textile-disc-16").altered(changes)


def test_touches_are_found_without_labels() -> None:
    error = missed(rubbed(), touches(TOUCHES, 0)[1])
    assert np.linalg.norm(error, axis=1).mean() < 0.012
    assert held(error, rubbed().presses.spreads) > 0.85
    assert rubbed().holds
    assert rubbed().findings == ()


def test_a_locator_learns_from_them_and_is_honest() -> None:
    asked, xy = touches(200, 1)
    answer, covariance = rubbed().locator().predict(asked)
    assert np.linalg.norm(answer - xy, axis=1).mean() < 0.012
    assert held(answer - xy, covariance) > 0.85


def test_labels_are_kept_and_a_turned_skin_contradicts_them() -> None:
    dv, xy = touches(TOUCHES, 0)
    some = np.full(xy.shape, np.nan)
    some[:5] = xy[:5]
    found = Rubbing.of(dv, skin(), some)
    np.testing.assert_allclose(found.presses.xy[:5], xy[:5])
    assert not found.presses.spreads[:5].any()
    assert found.holds
    turned = skin().altered({"electrodes": {"first": "-90 deg"}})
    wrong = Rubbing.of(dv, turned, some)
    assert len(wrong.contradicted) > 2
    with pytest.raises(DataError, match="contradict the positions found"):
        wrong.locator()


def test_labels_that_lie_elsewhere_than_the_model_says_are_contradicted() -> None:
    """Some tens of millimetres each are none, but all together a few."""
    dv, _ = touches(TOUCHES, 0)
    places, some = rubbed().presses.xy, np.full((TOUCHES, 2), np.nan)
    some[:10] = places[:10] + 0.003 * np.array([1, -1])
    found = Rubbing.of(dv, skin(), some)
    assert found.holds
    assert found.locator().presses.modelled
    inwards = np.where(places > 0, -0.012, 0.012)
    some[:10] = (places + inwards)[:10]
    with pytest.raises(DataError, match="frames 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 contradict"):
        Rubbing.of(dv, skin(), some).locator()
    some[:25] = (places + inwards)[:25]
    enough = Rubbing.of(dv, skin(), some)
    assert enough.by_labels
    assert not enough.locator().presses.modelled


def test_a_faint_rub_is_the_models_too_and_noise_is_not() -> None:
    dv, _ = touches(TOUCHES, 0)
    noise = np.random.default_rng(3).normal(size=dv.shape)
    usual = np.sqrt(np.median(np.sum(dv**2, axis=1)) / dv.shape[1])
    faint = Rubbing.of(dv + usual * noise, skin())
    assert faint.modelled
    assert np.linalg.norm(missed(faint, touches(TOUCHES, 0)[1]), axis=1).mean() < 0.02
    assert not Rubbing.of(noise, skin()).modelled


def test_touches_on_half_of_the_skin_are_said() -> None:
    found = Rubbing.of(touches(TOUCHES, 2, side=0.1)[0], skin())
    assert 6 in found.quiet
    assert "no touch came near" in found.findings[-1]
    assert "E7" in found.findings[-1]


def test_rows_in_another_order_are_not_this_skin() -> None:
    dv = touches(TOUCHES, 0)[0]
    found = Rubbing.of(dv[:, np.random.default_rng(1).permutation(dv.shape[1])], skin())
    assert found.alike < rubbed().alike
    assert "the pattern or the skin may be another one" in found.findings[0]


def test_what_cannot_be_learnt_from_is_refused() -> None:
    dv, xy = touches(TOUCHES, 0)
    with pytest.raises(DataError, match="at least 150 touches, got 100"):
        Rubbing.of(dv[:100], skin())
    with pytest.raises(DataError, match="xy of shape"):
        Rubbing.of(dv, skin(), xy[:5])
    with pytest.raises(DataError, match="shape"):
        Rubbing.of(dv[:, :5], skin())
    with pytest.raises(DataError, match="outside the skin"):
        Rubbing.of(dv, skin(), xy + 1.0)
    with pytest.raises(DataError, match="16 electrodes, but the skin has 8"):
        Rubbing.of(dv, skin(), pattern=Pattern.adjacent(16))


@pytest.mark.data
def test_a_real_skin_that_no_setting_was_chosen_on(data_dir: Path) -> None:
    dv, xy, pattern = recorded(data_dir / "eskin_varsens16" / "concentric.npz", 250)
    disc = hydrogel("-73 deg")
    found = Rubbing.of(dv, disc, pattern=pattern)
    assert not found.modelled
    assert np.linalg.norm(missed(found, xy), axis=1).mean() < 0.007
    assert held(missed(found, xy), found.presses.spreads) > 0.8


@pytest.mark.data
def test_enough_labels_do_without_the_order_of_the_electrodes(data_dir: Path) -> None:
    """On full carbon black that order misleads; labels that contradict each other do not help."""
    dv, xy, pattern = recorded(data_dir / "eskin_varsens16" / "fullCB.npz", 300)
    disc = hydrogel("-75 deg")
    labels = np.full(xy.shape, np.nan)
    assert not Rubbing.of(dv, disc, labels, pattern=pattern).holds
    labels[:25] = xy[:25]
    found = Rubbing.of(dv, disc, labels, pattern=pattern)
    assert found.holds
    error = missed(found, xy)[25:]
    assert np.linalg.norm(error, axis=1).mean() < 0.014
    assert held(error, found.presses.spreads[25:]) > 0.8


def test_many_labels_that_contradict_each_other_are_refused() -> None:
    dv, xy = touches(TOUCHES, 0)
    labels = np.full(xy.shape, np.nan)
    labels[:25] = xy[25:50]
    found = Rubbing.of(dv, skin(), labels)
    assert len(found.contradicted) > 10
    assert not found.holds


def test_a_sheet_that_answers_as_its_model_says_is_located_by_it() -> None:
    found = rubbed()
    assert found.modelled
    dv, xy = touches(TOUCHES, 3)
    answer, covariance = found.locator().predict(4 * dv)  # harder than any that was made
    assert np.linalg.norm(answer - xy, axis=1).mean() < 0.016
    assert held(answer - xy, covariance) > 0.7


def test_fits_that_differ_much_are_refused() -> None:
    """So it is on sheets that are nothing like the model."""
    unsure = replace(rubbed(), disagreement=0.025)
    assert not unsure.holds
    with pytest.raises(DataError, match="differ by 25 mm"):
        unsure.locator()
