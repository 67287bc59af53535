"""A body that moves: what it does to the data, and its state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.extras.body import BodyExamples, BodyModel, BodyReader
from tomoskin.extras.body.body_model import Memory, plays_of
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
    examples = BodyExamples.checked(frames(angle, axis, random), time, angle=angle, axis=axis)
    return BodyModel.learn(examples, COVARIANCE)


def test_one_axis_has_its_direction_and_a_curved_part_and_its_angle_is_told():
    model = learnt()
    assert model.n_modes == 2
    assert not model.remembers
    assert np.degrees(model.error[0]) < 0.5
    along = SHAPES[0] - SHAPES[1]
    part, *_ = np.linalg.lstsq(model.directions, along)
    assert model.directions @ part == pytest.approx(along, abs=0.02 * np.abs(along).max())


def test_angle_and_axis_of_a_bend_along_any_axis(skin):
    axes, rows = np.radians([0.0, 45.0, 90.0, 135.0]), len(skin.response.reference)
    shapes = 1e-3 * np.random.default_rng(8).standard_normal((3, rows))

    def bent(angle, axis):
        parts = np.column_stack([np.ones_like(axis), np.cos(2 * axis), np.sin(2 * axis)])
        return angle[:, None] * parts @ shapes

    angle, axis = np.tile(ANGLES, len(axes)), np.repeat(axes, len(ANGLES))
    dv = bent(angle, axis) + NOISE * np.random.default_rng(0).standard_normal((len(axis), rows))
    examples = BodyExamples.checked(dv, np.arange(len(axis)) * 0.1, angle=angle, axis=axis)
    read = BodyReader(BodyModel.learn(examples, NOISE**2 * np.eye(rows)), skin.response)
    for k, (degrees, about) in enumerate(((25.0, 20.0), (50.0, 110.0), (20.0, 160.0))):
        data = bent(np.radians([degrees]), np.radians([about]))[0]
        found = read.push(data, (), skin.response.reference[:, None], 0.1 * k)
        assert np.degrees([found.angle, found.axis]) == pytest.approx([degrees, about], abs=2.0)


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
    assert np.degrees(less.error[0]) < 0.5


def test_a_sheet_begins_where_the_motion_that_was_learnt_left_it():
    """A play stands at the end that the way back pushed it to, and follows from there."""
    x = np.array([[0.5], [1.0], [0.5], [0.0]])
    for sign in (1.0, -1.0):
        memory = Memory(3, np.array([[0.08]]), sign * x)
        assert memory.features(np.zeros((1, 1)), 0.0) == pytest.approx(0.0)
        powers, past = np.split(memory.features(np.array([[0.2 * sign]]), 0.0)[0, :6], [3])
        assert powers == pytest.approx([0.2 * sign, 0.04, 0.008 * sign])
        assert past == pytest.approx([0.04 * sign, 0.0, 0.0])


def test_what_one_coordinate_does_takes_along_what_another_left_behind():
    """A point drawn by a rope: it turns towards where it is drawn."""
    widths = plays_of(np.array([0.1, 0.2]))
    assert widths.tolist() == [[0.1, 0.2], [0.1, np.inf], [np.inf, 0.2]]
    memory = Memory(1, widths, np.zeros((1, 2)))
    course = np.vstack([np.linspace([0, 0], [1, 0], 50), np.linspace([1, 0], [1, 1], 50)])
    plays = memory.over(course, np.arange(100.0))[0]
    assert plays[49] == pytest.approx([0.9, 0.0, 0.9, 0.0])
    assert plays[99] == pytest.approx([1.0, 0.8, 0.9, 0.8], abs=3e-3)


def test_plays_are_learnt_as_wide_as_the_sheet_has_them():
    """Those of two coordinates that strain the sheet together, each by its own amount."""
    widths = plays_of(np.array([0.15, 0.045]))
    dv, time, state = two_coordinates(0, 400)
    x = state / state.max(axis=0)
    dv = dv + 0.3 * Memory(1, widths, x).over(x, time)[0][:, :2] @ SHAPES[[1, 2]]
    examples = BodyExamples.checked(dv, time, state=state, names=("angle", "stretch"))
    assert BodyModel.learn(examples, COVARIANCE).widths == pytest.approx(widths)


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
    model = BodyModel.learn(
        BodyExamples.checked(dv, time, state=course[:, None], names=("angle",)), COVARIANCE
    )
    assert model.remembers
    assert np.degrees(model.error[0]) < 0.5


def two_coordinates(seed, n=300):
    """A body that bends and swells, smooth and curved, with what it does to the rows."""
    random, time = np.random.default_rng(seed), np.arange(n) * 0.1
    knots = random.uniform(0, 1, (n // 20 + 1, 2))
    knots[0] = 0.0
    at = np.arange(n) / 20
    x = np.column_stack([np.interp(at, np.arange(len(knots)), knots[:, k]) for k in (0, 1)])
    dv = x @ SHAPES[:2] + x[:, :1] * x @ SHAPES[1:] + NOISE * random.standard_normal((n, ROWS))
    return dv, time, x * [1.5, 0.2]


def test_the_errors_of_two_coordinates_are_those_of_the_noise():
    dv, time, state = two_coordinates(0)
    examples = BodyExamples.checked(dv, time, state=state, names=("angle", "stretch"))
    model = BodyModel.learn(examples, COVARIANCE)
    assert (model.error < [0.005, 0.0005]).all()
    assert not model.doubts()
    other = two_coordinates(1)
    left = other[0] - model.changes(other[2], other[1])
    assert np.sqrt(np.mean(left**2)) < 1.2 * NOISE


def test_without_an_encoder_the_state_is_an_amplitude_without_a_unit(skin):
    """One coordinate, though the data bend in two directions."""
    rows = len(skin.response.reference)
    shapes = 1e-3 * np.random.default_rng(7).standard_normal((2, rows))
    time = np.arange(200) * 0.1
    x = (1 - np.cos(time)) / 2
    noise = NOISE * np.random.default_rng(1).standard_normal((200, rows))
    dv = np.column_stack([x, 0.3 * x**2]) @ shapes + noise
    model = BodyModel.learn(BodyExamples.checked(dv, time), NOISE**2 * np.eye(rows))
    assert model.n_modes == 2
    assert model.body.names == ("latent 1",)
    assert not model.examples.names
    found = BodyReader(model, skin.response).push(dv[30], (), np.zeros((rows, 0)), 0.0)
    assert found.values == pytest.approx(model.body.state[30], rel=0.01)
    assert np.isnan(found.angle)
    assert found.state == "bend"
    assert (
        "outside"
        in BodyReader(model, skin.response).push(1.3 * dv[31], (), np.zeros((rows, 0)), 0.0).problem
    )


def test_an_encoder_that_stops_is_said():
    dv, time, state = two_coordinates(0)
    state[150:170] = state[150]
    examples = BodyExamples.checked(dv, time, state=state, names=("angle", "stretch"))
    assert "stopped or jumped" in BodyModel.learn(examples, COVARIANCE).doubts()[0]


def test_states_of_other_frames_are_refused_and_a_jump_is_said():
    dv, time, state = two_coordinates(0)
    examples = BodyExamples.checked(dv, time, state=state, names=("angle", "stretch"))
    order = np.random.default_rng(4).permutation(len(state))
    shuffled = BodyModel.learn(replace(examples, state=state[order]), COVARIANCE)
    with pytest.raises(DataError, match="do not follow the states: those of"):
        shuffled.doubts()
    jumped = state + np.where(np.arange(len(state)) < 150, 0.0, 3.0)[:, None] * [1.0, 0.0]
    said = BodyModel.learn(replace(examples, state=jumped), COVARIANCE).doubts()
    assert any("times their own scatter" in text for text in said)


def test_noise_is_no_bend():
    random = np.random.default_rng(3)
    dv = NOISE * random.standard_normal((len(ANGLES), ROWS))
    time = np.arange(len(ANGLES))
    with pytest.raises(DataError, match="larger than the noise"):
        BodyModel.learn(BodyExamples.checked(dv, time, angle=ANGLES), COVARIANCE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"angle": np.zeros(9)}, "6 moved frames"),
        ({"angle": np.ones(3)}, r"\(n,\) labels"),
        (
            {"angle": None, "axis": None, "state": np.ones((9, 4)), "names": tuple("abcd")},
            "at most 3",
        ),
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
        BodyExamples.checked(**(given | change))


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
    examples = BodyExamples.checked(dv, time, angle=ANGLES, axis=np.full(len(ANGLES), 0.5))
    model = BodyModel.learn(examples, np.eye(rows) * NOISE**2)
    return BodyReader(model, skin.response), shape, NOISE * random.standard_normal(rows)


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
