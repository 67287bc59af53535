"""Bends: their directions, angle and axis, and references by a joint's angle."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.learning import BendExamples, BendModel, BendReader, JointReference
from tomoskin.learning.bend.bend_model import Memory
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare
from tomoskin.sensing.fit import SpotModel

ROWS, NOISE = 40, 1e-5
ANGLES = np.radians([0, 10, 20, 30, 40, 50, 60, 50, 40, 30, 20, 10, 0] * 3)
RANDOM = np.random.default_rng(5)
SHAPES = RANDOM.standard_normal((3, ROWS)) * 1e-3
COVARIANCE = np.eye(ROWS) * NOISE**2


def frames(angle, axis, random):
    """Linear in the curvature's tensor, with a part that goes as the square of the angle."""
    double = 2 * axis
    parts = angle[:, None] * np.column_stack([np.ones_like(double), np.cos(double), np.sin(double)])
    dv = parts @ SHAPES + (angle * np.abs(angle))[:, None] * SHAPES[0] / 10
    return dv + NOISE * random.standard_normal(dv.shape)


def learnt(axes=(np.pi / 2,), seed=0):
    random = np.random.default_rng(seed)
    angle = np.tile(ANGLES, len(axes))
    axis = np.repeat(axes, len(ANGLES))
    time = np.arange(len(angle)) * 0.1
    examples = BendExamples.checked(frames(angle, axis, random), angle, axis, time)
    return BendModel.learn(examples, COVARIANCE)


def test_one_axis_has_its_direction_and_a_curved_part_and_its_angle_is_told():
    model = learnt()
    assert model.n_modes == 2
    assert not model.remembers
    assert np.degrees(model.error) < 0.5
    along = SHAPES[0] - SHAPES[1]
    part, *_ = np.linalg.lstsq(model.directions, along)
    assert model.directions @ part == pytest.approx(along, abs=0.02 * np.abs(along).max())


def test_angle_and_axis_of_a_bend_along_any_axis():
    model = learnt(np.radians([0.0, 45.0, 90.0, 135.0]))
    random = np.random.default_rng(1)
    angle, axis = np.radians([25.0, 50.0, -40.0]), np.radians([20.0, 110.0, 160.0])
    z = model.whiten(frames(angle, axis, random)) @ model.whiten(model.directions.T).T
    features = [
        Memory(model.n_modes, model.size, remembers=model.remembers).push(row, 0.0) for row in z
    ]
    told, turned = model.predict(np.array(features) @ model.weights)
    assert np.degrees(told) == pytest.approx(np.degrees(angle), abs=2.0)
    assert np.degrees(turned) == pytest.approx(np.degrees(axis), abs=2.0)


def test_rows_that_are_lacking_are_left_out_of_what_was_learnt():
    model = learnt()
    lacking = np.array([0, 7, 31])
    left = np.delete(np.arange(ROWS), lacking)
    less = model.without(lacking)
    assert less.directions.shape == (ROWS - 3, model.n_modes)
    assert less.covariance.shape == (ROWS - 3, ROWS - 3)
    along = (SHAPES[0] - SHAPES[1])[left]
    part, *_ = np.linalg.lstsq(less.directions, along)
    assert less.directions @ part == pytest.approx(along, abs=0.02 * np.abs(along).max())
    assert np.degrees(less.error) < 0.5


def test_a_sheet_begins_where_the_bends_that_were_learnt_left_it():
    """Plays stand at the end that the way back pushed them to, and follow from there."""
    z = np.array([[0.5], [1.0], [0.5], [0.0]])
    plays = Memory.plays_after(z, 1.0)
    assert plays[:, 0] == pytest.approx([0.03, 0.08, 0.16, 0.3])
    memory = Memory(1, 1.0, remembers=True, plays=plays)
    assert memory.push(np.array([0.2]), 0.0)[2:6] == pytest.approx([0.17, 0.12, 0.16, 0.3])
    assert Memory.plays_after(-z, 1.0) == pytest.approx(-plays)


def test_what_lags_behind_by_a_play_is_undone():
    """Half a degree is left of a loop that is six wide."""
    random = np.random.default_rng(2)
    course = np.radians(np.interp(np.arange(400), np.arange(0, 401, 25), [0, 60] * 8 + [0]))
    lagging, play = [], 0.0
    for value in course:
        play = float(np.clip(play, value - 0.15, value + 0.15))
        lagging.append(0.7 * value + 0.3 * play)
    dv = frames(np.array(lagging), np.full(400, np.pi / 2), random)
    time = np.arange(400) * 0.1
    model = BendModel.learn(
        BendExamples.checked(dv, course, np.full(400, np.pi / 2), time), COVARIANCE
    )
    assert model.remembers
    assert np.degrees(model.error) < 0.5


def test_noise_is_no_bend():
    random = np.random.default_rng(3)
    dv = NOISE * random.standard_normal((len(ANGLES), ROWS))
    time = np.arange(len(ANGLES))
    with pytest.raises(DataError, match="larger than the noise"):
        BendModel.learn(BendExamples.checked(dv, ANGLES, np.zeros(len(ANGLES)), time), COVARIANCE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"angle": np.zeros(9)}, "6 bent frames"),
        ({"angle": np.ones(3)}, r"\(n,\) labels"),
        ({"time": np.zeros(9)}, "in the order"),
        ({"dv": np.full((9, ROWS), np.nan)}, "finite"),
    ],
)
def test_examples_that_teach_nothing_are_refused(change, message):
    given = {
        "dv": np.ones((9, ROWS)),
        "angle": np.arange(9.0),
        "axis": np.zeros(9),
        "time": np.arange(9.0),
    }
    with pytest.raises(DataError, match=message):
        BendExamples.checked(**(given | change))


@pytest.fixture(scope="module")
def skin():
    chosen = Skin.load("textile-disc-8")
    return SpotModel.of(chosen, prepare(chosen).model)


def reader(skin, seed=0):
    """A reader on a skin whose bends move the rows as its electrodes' pairs are numbered."""
    rows = len(skin.response.reference)
    shape = 1e-3 * np.random.default_rng(9).standard_normal(rows)
    random = np.random.default_rng(seed)
    dv = ANGLES[:, None] * shape + NOISE * random.standard_normal((len(ANGLES), rows))
    time = np.arange(len(ANGLES)) * 0.1
    examples = BendExamples.checked(dv, ANGLES, np.full(len(ANGLES), 0.5), time)
    model = BendModel.learn(examples, np.eye(rows) * NOISE**2)
    return BendReader(model, skin.response), shape, NOISE * random.standard_normal(rows)


def test_states_of_a_sheet(skin):
    read, shape, noise = reader(skin)
    common = skin.response.reference[:, None]
    idle = read.push(noise, (), common, 0.0)
    bent = read.push(noise + np.radians(30) * shape, (), common, 0.1)
    strange = 1e-3 * np.random.default_rng(4).standard_normal(len(shape))
    assert idle.state == "idle"
    assert bent.state == "bend"
    assert np.degrees(bent.angle) == pytest.approx(30, abs=1)
    assert bent.axis == pytest.approx(0.5, abs=1e-4)
    assert bent.moved == pytest.approx(np.radians(30) * shape, abs=3 * NOISE)
    assert read.push(strange, (), common, 0.2).state == "unknown"


def test_rows_that_are_lost_do_not_count_in_the_angle(skin):
    read, shape, noise = reader(skin)
    lost = np.zeros(len(shape), bool)
    lost[::4] = True
    data = np.where(lost, 0.0, noise + np.radians(30) * shape)
    common = skin.response.reference[:, None]
    told = np.hstack([common, np.eye(len(shape))[:, lost]])
    found = read.push(data, (), told, 0.0)
    assert np.degrees(found.angle) == pytest.approx(30, abs=1)
    assert found.state == "bend"
    assert read.push(data, (), common, 0.1).state == "unknown"


def test_a_reading_that_is_no_touch_to_who_saw_the_frames_before(skin):
    from tomoskin.core import Detection

    read, _, noise = reader(skin)
    common = skin.response.reference[:, None]
    left = Detection(x=0.0, y=0.0, sd_x=1e-3, sd_y=1e-3, area=1e-4, peak=-1e-6,
                   cells=np.zeros(1, int))  # fmt: skip
    assert read.push(noise, (left,), common, 0.0).state == "touch"
    assert read.push(noise, (left,), common, 0.1, touched=False).state == "idle"


def test_the_angle_is_read_beside_a_touch(skin):
    from tomoskin.core import Detection
    from tomoskin.sensing.fit.spot import depth_of, spots_of

    read, shape, noise = reader(skin)
    common = skin.response.reference[:, None]
    spot = spots_of(np.array([[0.03, 0.02]]), 0.015, -0.3)
    touch = skin.response.changes([spot])[0]
    fitted = Detection(
        x=0.031, y=0.0195, sd_x=1e-3, sd_y=1e-3, area=np.pi * 0.0145**2,
        peak=1.25 * np.expm1(float(depth_of(spot)[0])), cells=np.zeros(1, int),
    )  # fmt: skip
    data = noise + np.radians(30) * shape + touch
    found = read.push(data, (fitted,), common, 0.0)
    assert found.state == "bend and touch"
    assert np.degrees(found.angle) == pytest.approx(30, abs=1.5)
    blind = read.push(data, (), common, 0.1)
    assert abs(blind.angle - np.radians(30)) > abs(found.angle - np.radians(30))


def test_references_between_recorded_angles():
    random = np.random.default_rng(6)
    angle = np.repeat(np.radians([0.0, 20.0, 40.0, 60.0]), 10)
    level = 1.0 + np.outer(angle, SHAPES[0]) + np.outer(angle**2, SHAPES[1])
    joint = JointReference.of(level + NOISE * random.standard_normal(level.shape), angle)
    at = np.radians(30)
    wanted = 1.0 + at * SHAPES[0] + at**2 * SHAPES[1]
    assert joint.at(at).mean == pytest.approx(wanted, abs=1e-4)
    assert joint.at(0.0).mean == pytest.approx(np.ones(ROWS), abs=2 * NOISE)
    assert joint.at(at).noise == pytest.approx(np.full(ROWS, NOISE), rel=0.5)
    assert joint.at(at).n_frames == 10
    with pytest.raises(DataError, match=r"from 0\.0° to 60\.0°, got 75\.0°"):
        joint.at(np.radians(75))


def test_a_joint_that_was_not_moved_is_no_reference():
    with pytest.raises(DataError, match="two or more angles"):
        JointReference.of(np.ones((5, ROWS)), np.zeros(5))
