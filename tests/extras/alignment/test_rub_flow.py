"""A rubbed skin, frame by frame: what counts, what is missing, what is learnt, what ends it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from extras.alignment.rubbed import rubbed_with_a_lag
from extras.alignment.test_rubbing import touches
from tomoskin.core import DataError, Detection, Touch, WireError
from tomoskin.extras.alignment import Rubbing
from tomoskin.extras.alignment.rub_flow import RubFlow
from tomoskin.learning import Locator
from tomoskin.server.guided_flow import StoppedError
from tomoskin.server.requests import AskPoint, DeletePress, LearnFlow, StopLearning

RATE = 0.03
REST = 0.1


def spot(number, x, y):
    found = Detection(x, y, 1e-3, 1e-3, 1e-4, -1e-3, np.empty(0, np.int64))
    return Touch(number, "decrease", 0.0, found)


class Rubber:
    """Shows a flow frames of a skin that reads ``REST`` untouched."""

    def __init__(self, flow):
        self.flow, self.time = flow, 10.0

    def show(self, dv, *shown):
        self.time += RATE
        rest = np.full(len(dv), REST)
        self.flow.see(
            SimpleNamespace(
                host_time=self.time,
                voltages=rest + dv,
                reference=rest,
                touches=shown,
                health=None,
                baseline=None,
            )
        )

    def rub(self, n, seed=0, side=-1.0, fingers=1):
        dv, xy = touches(n, seed, side)
        for row, (x, y) in zip(dv, xy, strict=True):
            self.show(row, *[spot(k, x, y) for k in range(fingers)])
        self.time += 1.0  # the pages are told
        self.show(np.zeros(dv.shape[1]))


@pytest.fixture
def rubber(prepared):
    return Rubber(RubFlow(prepared))


def learn(flow):
    assert flow.answers[LearnFlow](LearnFlow())
    return flow.estimated(flow.examples())


def test_the_map_fills_and_a_word_says_when_it_is_enough(rubber):
    flow = rubber.flow
    rubber.rub(100)
    half = flow.now().rubbed
    assert half.touches == 100
    assert half.text == "50 more to learn from."
    assert 0 < np.count_nonzero(half.covered) < len(half.covered)
    with pytest.raises(WireError, match="50 more touches are needed"):
        flow.answers[LearnFlow](LearnFlow())
    rubber.rub(150, seed=1)
    full = flow.now().rubbed
    assert full.enough, full.text
    assert "Enough to learn from" in full.text
    assert np.count_nonzero(full.covered) > 0.9 * len(full.covered)


def test_what_was_rubbed_is_learnt_and_says_how_sure_it_is(rubber):
    rubber.rub(160)
    estimate = learn(rubber.flow)
    assert estimate.ready
    assert isinstance(estimate.answer, Locator)
    assert "positions are uncertain by about" in estimate.text
    dv, xy = touches(60, 7)
    missed = np.linalg.norm(estimate.answer.predict(dv)[0] - xy, axis=1)
    assert np.median(missed) < 0.015
    assert estimate.figures.deviation_mm < 15


def test_a_finger_that_slides_tells_how_far_the_sheet_lags(rubber):
    dv, time = rubbed_with_a_lag(0.012)
    for row, rubber.time in zip(dv, time, strict=True):
        rubber.show(row, spot(1, 0.0, 0.0))
    assert learn(rubber.flow).answer.presses.slide_lag == pytest.approx(0.012, abs=3e-3)


def test_a_finger_that_stands_still_and_two_hands_do_not_count(rubber):
    flow = rubber.flow
    dv, _ = touches(1, 0)
    for _ in range(40):
        rubber.show(dv[0], spot(1, 0.0, 0.0))
    rubber.time += 1.0
    rubber.show(dv[0])
    assert flow.now().rubbed.touches == 1
    rubber.rub(60, fingers=2)
    text = flow.now().rubbed.text
    assert "60 % of the frames show several touches" in text
    assert "one finger of one hand" in text
    assert flow.now().rubbed.touches == 1


def test_half_of_the_skin_is_said_by_the_map_and_by_the_electrodes(rubber):
    rubber.rub(160, seed=2, side=0.1)
    text = rubber.flow.now().rubbed.text
    assert "of the skin is touched: go on where the map is empty" in text
    rubbed = replace(rubber.flow.rubbed, covered=np.ones(9))
    assert "No touch has come near E" in rubbed.text
    assert "E7" in rubbed.text
    assert not rubbed.enough
    assert rubber.flow.rubbed.gap[0].startswith("only ")
    assert not rubbed.gap


def test_another_pattern_is_refused_in_words(rubber):
    dv, xy = touches(160, 0)
    shuffled = dv[:, np.random.default_rng(1).permutation(dv.shape[1])]
    for row, (x, y) in zip(shuffled, xy, strict=True):
        rubber.show(row, spot(1, x, y))
    rubber.time += 1.0
    rubber.show(np.zeros(dv.shape[1]))
    with pytest.raises(DataError, match="the pattern or the skin may be another one"):
        learn(rubber.flow)


def test_learning_is_ended_when_it_is_asked_to(rubber, monkeypatch):
    rubber.rub(150)
    flow = rubber.flow
    started, original = [], Rubbing.of

    def stop(*_args, **_more):
        started.append(flow.stage)
        flow.answers[StopLearning](StopLearning())
        return original(*_args, **_more)

    monkeypatch.setattr(Rubbing, "of", stop)
    with pytest.raises(StoppedError):
        learn(flow)
    assert started == ["finding where the touches were"]


def test_known_positions_are_taken_beside_the_rubbing(rubber):
    flow = rubber.flow
    rubber.rub(20)
    flow.answers[AskPoint](AskPoint(on=True))
    first = flow.now().dot
    rng = np.random.default_rng(0)
    dv = 1e-3 * np.ones(40)
    for frame in range(40):
        noise = 1e-6 * rng.normal(size=40)
        rubber.show((dv if frame > 18 else 0 * dv) + noise)
    fields = flow.now()
    assert fields.presses == [first]
    assert fields.dot != first
    assert fields.rubbed.touches == 20, "a press at the dot is no rubbing"
    flow.answers[DeletePress](DeletePress())
    assert flow.now().presses == []
    flow.answers[AskPoint](AskPoint(on=False))
    assert flow.now().dot is None
    with pytest.raises(WireError, match="no press"):
        flow.answers[DeletePress](DeletePress())
