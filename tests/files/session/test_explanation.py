"""One frame, step by step."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError, observe_steps, show
from tomoskin.files.session import Session, SessionReader, explain
from tomoskin.files.session.explanation import described, meanings
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult
from tomoskin.run import simulate
from tomoskin.twin import Script

SCRIPT = """
format = 1
[script]
duration = "4.5 s"
seed = 2
[[press]]
id = "a"
radius = "15 mm"
at = ["20 mm", "-10 mm"]
start = "1.5 s"
force = "6 N"
hold = "1 s"
"""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path = tmp_path_factory.mktemp("explained") / "press.mcap"
    simulate(Script.from_toml(SCRIPT), Skin.load("textile-disc-8"), path)
    return path


@pytest.fixture(scope="module")
def results(recorded) -> list[FrameResult]:
    return list(Session(recorded))


def at(recorded, frame: int):
    with SessionReader(recorded) as session:
        return explain(session, frame)


def frame_with(results, kind: str) -> int:
    return next(k for k, one in enumerate(results) if any(e.kind == kind for e in one.events))


def test_it_is_the_replays_own_result(recorded, results):
    number = frame_with(results, "onset") + 3
    found, known = at(recorded, number).result, results[number]
    assert found.touches[0].detection.x == known.touches[0].detection.x
    assert np.array_equal(found.image.values, known.image.values)


def test_the_steps_stand_in_the_order_of_the_flow(recorded, results):
    steps = [step.name for step in at(recorded, frame_with(results, "onset")).steps]
    order = ("frame", "voltages", "conditioned", "image", "hypotheses", "detections", "touches")
    assert list(dict.fromkeys(name for name in steps if name in order)) == list(order)


def test_it_says_why_a_touch_began_stayed_and_ended(recorded, results):
    onset, release = (frame_with(results, kind) for kind in ("onset", "release"))
    (began,) = at(recorded, onset).of_touch(1)
    assert "initiated: the logarithm of its odds is" in began
    (stayed,) = at(recorded, onset + 5).of_touch(1)
    assert "associated: a detection lies" in stayed
    ended = at(recorded, release).of_touch(1)
    assert "deleted" in ended[-1]


def test_the_taken_hypothesis_has_the_most_evidence(recorded, results):
    steps = at(recorded, frame_with(results, "onset") + 8).steps
    hypotheses = next(step.record for step in steps if step.name == "hypotheses")
    taken = next(one for one in hypotheses if one.is_taken)
    assert taken.name == "1 touch"
    assert taken.evidence > next(one for one in hypotheses if one.name == "nothing").evidence


def test_arrays_are_told_by_shape_range_and_meaning(recorded):
    lines = list(at(recorded, 30).lines)
    assert any("values = (40,) float64, " in line and "V, in the order" in line for line in lines)
    assert meanings(FrameResult)["touches"] == "Tracked touches."


def test_a_frame_of_the_reference_has_no_touches_yet(recorded):
    assert [step.name for step in at(recorded, 0).steps] == ["frame"]


def test_a_frame_that_is_not_there_is_refused_with_those_that_are(recorded, results):
    with pytest.raises(DataError, match=f"expected a frame from 0 to {len(results) - 1}, got 9999"):
        at(recorded, 9999)


def test_without_an_observer_nothing_is_made():
    made = []
    show("step", lambda: made.append(1))
    assert made == []
    seen = []
    with observe_steps(lambda name, record: seen.append((name, record))):
        show("step", lambda: 7)
    show("later", 8)
    assert seen == [("step", 7)]


def test_what_nothing_describes_is_told_plainly():
    assert list(described([])) == ["none"]
    assert list(described({"a": 1.0})) == ["a = 1"]
    assert list(described(np.array([True, False]))) == ["(2,) bool, 1 of 2"]
