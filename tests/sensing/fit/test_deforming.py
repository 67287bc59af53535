"""A sheet that deforms, frame after frame: what is told of it, and how often it is solved."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from sensing.fit.scene import covariance, noise
from tomoskin.core import Detection, FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import EXHAUSTIVE, LIVE, SpotFinder, SpotModel, spots_of
from tomoskin.sensing.fit.deformation import StrainLaw
from tomoskin.sensing.fit.deformed_frame import FrameData
from tomoskin.sensing.fit.deforming import Deforming
from tomoskin.sensing.fit.policy import DetectionPolicy
from tomoskin.sensing.fit.strain import Strain
from tomoskin.sensing.fit.strain_fit import Explained
from tomoskin.sensing.fit.strain_state import StrainState
from tomoskin.sensing.fit.strained_sheet import StrainedSheet

NOTHING = np.zeros((40, 0))
FOLD = Strain("fold", np.array([0.4, 0.02, math.log(0.02), -0.12, -0.08]))
ACROSS = Strain("fold", np.array([1.7, -0.03, math.log(0.02), -0.12, -0.08]))


@cache
def skin() -> Skin:
    own = {"touch": {"method": "fit"}, "mesh": {"cells": 700}}
    return Skin.load("textile-disc-8").altered(own)


@cache
def model() -> SpotModel:
    s = skin()
    return SpotModel.of(s, ForwardModel(s.mesh(), s.pattern(), s.contact_impedance, s.current))


def finder() -> SpotFinder:
    """A live one."""
    pace = replace(LIVE, scan_time=0.05, interval=0.05)
    return SpotFinder(model(), skin(), skin().mesh(), covariance(8), pace=pace)


def followed(
    own: SpotFinder, change: FloatArray, frames: int, seed: int = 1, *, ramp: int = 8
) -> list[list[Detection]]:
    """Touches of so many frames in which a ``change`` (40,) V comes within ``ramp`` frames."""
    part = np.minimum(np.arange(1, frames + 1) / ramp, 1.0)
    rows = part[:, None] * change + noise(8, frames, seed)
    return [own.push(row, NOTHING) for row in rows]


def test_a_fold_that_is_held_is_no_touch_and_is_seldom_solved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    own, counts = finder(), {"solved": 0, "fitted": 0}
    change = model().strained.change(FOLD)
    began = followed(own, change, 40)
    assert not any(began[12:])
    state, solve, fit = own.deforming.state, StrainedSheet.change, FrameData.fitted

    def solved(sheet: StrainedSheet, strain: Strain) -> FloatArray:
        counts["solved"] += 1
        return solve(sheet, strain)

    def fitted(frame: FrameData, begin: StrainState) -> Explained:
        counts["fitted"] += 1
        return fit(frame, begin)

    monkeypatch.setattr(StrainedSheet, "change", solved)
    monkeypatch.setattr(FrameData, "fitted", fitted)
    most = 0
    for row in change + noise(8, 40, 2):
        before = counts["fitted"]
        assert not own.push(row, NOTHING)
        most = max(most, counts["fitted"] - before)
    assert state is not None
    told = own.deforming.told
    assert told is not None
    assert told.kind == "fold"
    assert told.axis is not None
    assert told.axis.value == pytest.approx(0.4, abs=0.1)
    assert most <= 2  # a review holds one other deformation against it in a frame
    assert counts["solved"] - 9 * counts["fitted"] < 15  # beside reviews, of 40 frames


def test_two_folds_are_neither_a_fold_nor_touches() -> None:
    own, sheet = finder(), model().strained
    found = followed(own, sheet.change(FOLD) + sheet.change(ACROSS), 40)
    told = own.deforming.told
    assert told is not None
    assert (told.kind, told.amount, told.axis) == ("unknown", None, None)
    assert not any(found[30:])
    assert "no touch is shown" in told.text


def test_a_press_on_a_fold_is_found() -> None:
    own, sheet = finder(), model().strained
    fold = sheet.change(FOLD)
    followed(own, fold, 30)
    press = sheet.response(FOLD).changes([spots_of([[-0.03, 0.04]], 0.014, -0.5)])[0]
    for row in fold + press + noise(8, 12, 3):
        (found,) = own.push(row, NOTHING)
    assert math.hypot(found.x + 0.03, found.y - 0.04) < 0.006
    assert own.deforming.told is not None
    assert own.deforming.told.kind == "fold"


def test_a_strain_that_no_sheet_has_is_held_to_one_that_can_be_solved() -> None:
    sheet = model().strained
    far = sheet.prior.held(Strain("stretch", np.array([-9.0, 12.0, 0.0])), sheet.reach)
    assert far.is_beyond
    assert np.isfinite(sheet.response(far).reference).all()
    assert not FOLD.is_beyond


def test_what_is_not_known_settles_and_says_the_same_as_each_frame_by_itself() -> None:
    sheet, matrix = model().strained, np.eye(40) / 3e-5
    state = StrainState.about(sheet, FOLD)
    slow = 0.3 * np.ones((1, 40))
    seen: list[FloatArray] = []
    for _ in range(200):
        state = state.after(moves=False)
        rows = state.spread.seen(matrix)
        left = seen[-1] if seen and seen[-1][:-1] is rows else np.vstack([rows, slow])
        alone, whole = state.told_alone(matrix[0], left), state.told(matrix[0], rows, slow)
        assert alone.mean == pytest.approx(whole.mean, rel=1e-6, abs=1e-9)
        assert alone.covariance == pytest.approx(whole.covariance, rel=1e-6, abs=1e-12)
        state = replace(alone, mean=state.mean)
    expected = state.after(moves=False).spread
    assert expected is state.spread.before  # so nothing is computed of it again


@pytest.mark.parametrize(
    ("gain", "leaves", "wins"),
    [(14.0, 0.0, True), (9.0, 0.0, False), (14.0, 12.0, False)],
    ids=["clear", "not much", "leaves more"],
)
def test_one_frame_alone_is_a_deformation_only_where_that_is_clear(
    monkeypatch: pytest.MonkeyPatch, gain: float, leaves: float, wins: bool
) -> None:
    """Three presses have more unknowns than a fold, and yet are what explains their frame."""
    policy = DetectionPolicy.of(skin().touch, EXHAUSTIVE)
    own = Deforming(model().strained, StrainLaw(), policy)
    state = StrainState.about(own.sheet, FOLD)
    monkeypatch.setattr(own, "_others", lambda *_: [(Explained(state, 0.0, 0.0), 6.0)])

    def search(begin: StrainState | None) -> Any:
        spots = np.zeros((3 if begin is None else 0, 4))
        beyond = 5.0 if begin is None else 5.0 + leaves
        fit = SimpleNamespace(spots=spots, beyond=beyond, degrees=28, predicted=np.zeros(40))
        odds = 0.0 if begin is None else gain - 3 * math.log(200)
        return SimpleNamespace(detected=SimpleNamespace(fit=fit), evidence=odds, state=begin)

    frame = FrameData(np.zeros(40), None, model(), np.zeros((0, 4)))  # type: ignore[arg-type]
    found = own.decided(frame, search)
    assert (found.state is state) is wins
