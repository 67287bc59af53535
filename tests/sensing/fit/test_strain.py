"""Smooth strains of a sheet: what they are, and what they do to its voltages."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import Response
from tomoskin.sensing.fit.deformation import Deformation, StrainLaw
from tomoskin.sensing.fit.strain import Strain, exponential, profile
from tomoskin.sensing.fit.strain_fit import likeliest, starts
from tomoskin.sensing.fit.strain_spread import Spread
from tomoskin.sensing.fit.strain_state import StrainState
from tomoskin.sensing.fit.strained_sheet import StrainedSheet

FOLD = Strain("fold", np.array([1.0, 0.02, math.log(0.02), -0.05, -0.03]))
STRETCH = Strain("stretch", np.array([-0.1, 0.05, -0.08]))


@pytest.fixture(scope="module")
def sheet() -> StrainedSheet:
    skin = Skin.load("textile-disc-8").altered({"mesh": {"cells": 700}})
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    return StrainedSheet(Response(model.at(skin.conductivity)))


def test_a_fold_and_a_strip_have_the_same_content_and_breadth() -> None:
    q = np.linspace(-6, 6, 4001)
    height = profile(q)[0]
    step, content = q[1] - q[0], math.sqrt(2 * math.pi)
    assert height.sum() * step == pytest.approx(content, rel=1e-5)
    assert (q**2 * height).sum() * step == pytest.approx(content, rel=1e-5)
    fourth = (q**4 * height).sum() * step / content
    assert 1.8 < fourth < 3.0  # an even strip of that second moment has 1.8, a normal one 3


@pytest.mark.parametrize("strain", [FOLD, STRETCH], ids=["fold", "stretch"])
def test_slopes_are_those_of_the_field(strain: Strain) -> None:
    points = np.random.default_rng(3).uniform(-0.08, 0.08, (50, 2))
    slopes = strain.slopes(points)
    for number in range(len(strain.numbers)):
        step = np.zeros(len(strain.numbers))
        step[number] = 1e-6
        apart = strain.moved(step).field(points) - strain.moved(-step).field(points)
        assert slopes[..., number] == pytest.approx(apart / 2e-6, rel=1e-5, abs=1e-7)


def test_the_exponential_is_that_of_the_matrix() -> None:
    tensors = np.array([[0.3, -0.1, 0.2], [0.0, 0.0, 0.0]])
    for (xx, yy, xy), found in zip(tensors, exponential(tensors), strict=True):
        size, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
        assert found == pytest.approx(vectors @ np.diag(np.exp(size)) @ vectors.T, abs=1e-12)


def test_an_even_stretch_is_one_tensor_all_over(sheet: StrainedSheet) -> None:
    model = sheet._state.model
    xx, yy, xy = STRETCH.field(np.zeros((1, 2)))[0]
    size, vectors = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]))
    tensor = sheet._state.conductivity[0] * vectors @ np.diag(np.exp(size)) @ vectors.T
    exact = model.at(np.tile(tensor, (len(sheet.points), 1, 1))).voltages
    assert sheet.change(STRETCH) == pytest.approx(exact - sheet._state.voltages, abs=1e-9)


def test_a_level_alone_scales_all_voltages_but_for_the_contacts(sheet: StrainedSheet) -> None:
    change = sheet.change(Strain("stretch", np.array([0.05, 0.0, 0.0])))
    at_rest = sheet._state.voltages
    factor = change @ at_rest / (at_rest @ at_rest)
    assert factor == pytest.approx(math.expm1(-0.05), rel=1e-2)
    assert np.linalg.norm(change - factor * at_rest) < 0.01 * np.linalg.norm(change)


@pytest.mark.parametrize("strain", [FOLD, STRETCH], ids=["fold", "stretch"])
def test_slopes_of_a_faint_strain_are_those_of_the_voltages(
    sheet: StrainedSheet, strain: Strain
) -> None:
    faint = strain.numbers.copy()
    faint[3 if strain.kind == "fold" else 0 :] *= 0.01
    at = Strain(strain.kind, faint)
    slopes = sheet.directions(at, at.size)[:, : len(faint)]
    for number in range(len(faint)):
        step = np.zeros(len(faint))
        step[number] = 1e-4
        apart = (sheet.change(at.moved(step)) - sheet.change(at.moved(-step))) / 2e-4
        assert np.linalg.norm(slopes[:, number] - apart) < 0.05 * np.linalg.norm(apart)


def test_the_strained_sheet_with_a_metric_has_the_voltages_of_its_tensors(
    sheet: StrainedSheet,
) -> None:
    other = sheet.response(FOLD)
    change = other.reference - sheet._state.voltages
    assert np.linalg.norm(change - sheet.change(FOLD)) < 0.03 * np.linalg.norm(change)


@pytest.mark.parametrize("angle", [0.3, 1.9])
def test_the_likeliest_fold_is_the_one_that_was_made(sheet: StrainedSheet, angle: float) -> None:
    made = Strain("fold", np.array([angle, -0.03, math.log(0.022), -0.12, -0.06]))
    full = np.eye(len(sheet._state.voltages)) / 2e-5
    none = np.zeros((0, len(full)))
    data = sheet.change(made)
    (begin, *_) = starts(sheet, data, full, none, 2)
    found = likeliest(StrainState.about(sheet, begin), data, full, none)
    stretch = likeliest(StrainState.about(sheet, Strain.none()), data, full, none)
    assert found.evidence > stretch.evidence + 100
    told = found.state.told(full @ (data - found.state.moved), found.state.spread.seen(full), none)
    record = Deformation.of(told, StrainLaw())
    assert record.kind == "fold"
    assert record.axis is not None
    assert record.offset is not None
    assert record.axis.value == pytest.approx(angle, abs=0.05)
    assert record.offset.value == pytest.approx(-0.03, abs=0.01)
    assert record.axis.low < angle < record.axis.high
    assert record.offset.low < -0.03 < record.offset.high


def test_a_law_turns_levels_into_strain_and_height_into_an_angle(sheet: StrainedSheet) -> None:
    strain, width, height = 0.015, 0.02, 3e-3
    numbers = np.array([0.4, 0.0, math.log(width), -10 * strain / 2, -5 * strain / 2])
    state = StrainState.about(sheet, Strain("fold", numbers))
    n = len(state.mean)
    state = StrainState(
        sheet, state.at, state.change, np.zeros(n), Spread(state.directions, 1e-8 * np.eye(n)), 0.1
    )
    bare = Deformation.of(state, StrainLaw())
    assert (bare.unit, bare.amount and round(bare.amount.value, 3)) == ("relative", -0.106)
    strained = Deformation.of(state, StrainLaw(10.0, 5.0))
    assert strained.unit == "strain"
    assert strained.amount is not None
    assert strained.amount.value == pytest.approx(strain, rel=1e-6)
    bent = Deformation.of(state, StrainLaw(10.0, 5.0, height))
    assert bent.amount is not None
    assert bent.unit == "rad"
    angle = strain * math.sqrt(2 * math.pi) * width / height
    assert bent.amount.value == pytest.approx(angle)
    assert "bent along a line at 23°" in bent.text


def test_a_level_alone_is_told_as_what_it_may_be(sheet: StrainedSheet) -> None:
    state = StrainState.about(sheet, Strain("stretch", np.array([-0.05, 1e-5, 0.0])))
    n = len(state.mean)
    state = StrainState(
        sheet, state.at, state.change, np.zeros(n), Spread(state.directions, 1e-6 * np.eye(n)), 0.1
    )
    told = Deformation.of(state, StrainLaw(10.0, 5.0))
    assert told.kind == "common"
    assert "gain or supply" in told.text
    assert told.facts["axis"] is None
