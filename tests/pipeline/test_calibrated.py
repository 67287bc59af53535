"""A calibration of touch inside the fit: several touches, each where the presses say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tomoskin.core import FloatArray, Voltages
from tomoskin.learning import FORCE, TOUCH, AmountModel, LabelledPresses, Locator
from tomoskin.learning.touch.fit_trial import together
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Pipeline, Prepared, prepare
from tomoskin.pipeline.frame_result import FrameResult
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.sensing.segment import Region

FITTED = prepare(Skin.load("textile-disc-8"))
NOISE = 2e-7
RADIUS, DEPTH = 0.014, 0.4
TURN = 0.25
"""rad by which the rig's positions are turned against the skin's: what only labels can tell."""

PLACES = (np.array([0.03, 0.02]), np.array([-0.03, -0.025]))


def change(*places: FloatArray) -> FloatArray:
    """(n_meas,) V of presses at ``places``, on a mesh that is not the fit's."""
    model, sigma = FITTED.model, np.full(len(FITTED.mesh.cells), FITTED.skin.conductivity)
    for place in places:
        square = ((FITTED.mesh.centroids[:, :2] - place) ** 2).sum(axis=1)
        sigma = sigma * (1 - DEPTH * np.exp(-square / RADIUS**2))
    return np.asarray(model.at(sigma).voltages - FITTED.operator.reference)


def turned(places: FloatArray) -> FloatArray:
    """(n, 2) m as the rig counts them."""
    cos, sin = np.cos(TURN), np.sin(TURN)
    return np.asarray(places @ [[cos, sin], [-sin, cos]])


@pytest.fixture(scope="module")
def calibrated() -> Prepared:
    places = Region.of(FITTED.skin).lattice(70)
    places = 0.8 * Region.of(FITTED.skin).metres(places)
    dv = np.array([change(place) for place in places])
    dv += NOISE * np.random.default_rng(3).standard_normal(dv.shape)
    locator = Locator.fit(dv, turned(places), skin=FITTED.skin)
    return FITTED.calibrated(TOUCH.of(locator, FITTED.pattern, FITTED.skin))


def shown(prepared: Prepared, *places: FloatArray, size: float = 1.0) -> list[FrameResult]:
    """Frames of a skin that is pressed at ``places`` after its reference, ``size`` times the
    model's voltages."""
    random, pipeline = np.random.default_rng(5), Pipeline(prepared)
    rest = FITTED.operator.reference
    results = []
    for number in range(REFERENCE_FRAMES + 6):
        dv = change(*places) if places and number >= REFERENCE_FRAMES else 0.0
        values = size * (rest + dv + NOISE * random.standard_normal(len(rest)))
        none = np.zeros(len(rest), bool)
        results.append(
            pipeline.follow(Voltages(values, none, 0.05 * number, 0.05 * number, number))
        )
    return results[REFERENCE_FRAMES:]


def positions(result: FrameResult) -> FloatArray:
    return np.array([(t.detection.x, t.detection.y) for t in result.touches]).reshape(-1, 2)


@pytest.mark.parametrize("number", [1, 2])
def test_each_touch_is_where_the_labels_say(calibrated: Prepared, number: int) -> None:
    places = PLACES[:number]
    wanted = turned(np.array(places))
    for result in shown(calibrated, *places)[2:]:
        found = positions(result)
        assert len(found) == number
        apart = np.linalg.norm(found[:, None] - wanted, axis=2).min(axis=1)
        assert apart.max() < 0.004
    plain = positions(shown(FITTED, *places)[-1])
    assert np.linalg.norm(plain[:, None] - wanted, axis=2).min() > 0.006


def test_a_calibration_does_not_change_whether_there_is_a_touch(calibrated: Prepared) -> None:
    assert not any(result.touches for result in shown(calibrated))
    for places in (PLACES[:1], PLACES):
        one, other = shown(calibrated, *places), shown(FITTED, *places)
        assert [len(r.touches) for r in one] == [len(r.touches) for r in other]
        assert [t.detection.area for t in one[-1].touches] == pytest.approx(
            [t.detection.area for t in other[-1].touches], rel=0.05
        )


def test_on_a_rig_that_the_model_does_not_know_it_stands_alone_and_says_so(
    calibrated: Prepared,
) -> None:
    """As raw counts, whose size no model of voltages knows."""
    result = shown(calibrated, *PLACES[:1], size=40.0)[-1]
    assert result.calibration is not None
    assert result.calibration.alone
    assert "the calibration alone locates touches" in result.calibration.findings[-1]
    assert len(result.touches) == 1
    ours = shown(calibrated, *PLACES[:1])[-1].calibration
    assert ours is not None
    assert not ours.alone


def test_forces_are_told_beside_it_but_not_of_regions_of_an_image(calibrated: Prepared) -> None:
    detections = [shown(FITTED, s * PLACES[0])[-1].touches[0].detection for s in (1.0, 0.8, 0.6)]
    many = [replace(d, peak=f * d.peak) for d in detections for f in (0.5, 1.0, 1.5)]
    weighed = LabelledPresses.of(many, np.tile([1.0, 2.0, 3.0], 3), np.arange(9), np.arange(9.0))
    model = AmountModel.fit(weighed, FITTED.skin)
    both = calibrated.calibrated(FORCE.of(model, FITTED.pattern, FITTED.skin))
    assert all(t.detection.force is not None for t in shown(both, *PLACES)[-1].touches)
    alone = shown(both, *PLACES[:1], size=40.0)[-1]
    assert [t.detection.force for t in alone.touches] == [None]


def rubbed(calibrated: Prepared, xy: FloatArray, spread: FloatArray, **said: bool) -> Prepared:
    """The same with labels that a rub has found."""
    model = calibrated.calibrations[TOUCH.name].model
    presses = replace(model.presses, xy=xy, spread=spread, **said)
    locator = Locator.learn(presses, model.region, model.pattern, model.skin_id)
    return FITTED.calibrated(TOUCH.of(locator, FITTED.pattern, FITTED.skin))


def test_labels_of_the_same_model_say_no_more_than_the_fit(calibrated: Prepared) -> None:
    presses = calibrated.calibrations[TOUCH.name].model.presses
    spread = np.tile(1e-5 * np.eye(2), (len(presses), 1, 1))
    ours = shown(rubbed(calibrated, presses.xy, spread, modelled=True), *PLACES)[-1]
    assert positions(ours).tolist() == positions(shown(FITTED, *PLACES)[-1]).tolist()
    assert ours.calibration is not None


def test_where_labels_were_found_both_may_be_wrong() -> None:
    """The fit and the presses are 20 mm apart, and each is sure of itself."""
    sure = 1e-6 * np.eye(2)
    fitted, learnt = (np.array([x, 0.0]) for x in (0.01, 0.03))
    (known, within), (found, wide) = (
        together((fitted, sure), (learnt, sure), doubtful=doubtful) for doubtful in (False, True)
    )
    assert known == pytest.approx(learnt, abs=1e-3)
    assert found == pytest.approx((fitted + learnt) / 2, abs=1e-3)
    assert within[0, 0] < 2e-6
    assert 0.007 < np.sqrt(wide[0, 0]) < 0.02  # half of what they are apart
