"""A touch that slides, as the pipeline reports it with and without a lag of the sheet."""

import numpy as np
import pytest

from run.board import pressed, samples_of
from tomoskin.core import Frame
from tomoskin.learning import Kind
from tomoskin.learning.kind import Applied
from tomoskin.pipeline import Pipeline, prepare

NEEDED, STEP, INTERVAL = 5, 0.004, 0.05


def slid(prepared, shown):
    """Results of a pipeline that is shown these samples after its reference."""
    pipeline = Pipeline(prepared, reference_frames=NEEDED)
    rng, results = np.random.default_rng(3), []
    for n, samples in enumerate(shown):
        noisy = (samples + rng.integers(-1, 2, len(samples))).astype(np.uint16)
        ticks = round(INTERVAL * n * pipeline.tick_rate)
        results.append(pipeline.push(Frame(n, ticks, INTERVAL * n, 1, 0, 0, noisy)))
    return results[NEEDED:]


@pytest.fixture(scope="module")
def shown(prepared):
    idle = samples_of(prepared)
    way = [samples_of(prepared, pressed(prepared, -0.03 + STEP * k, 0.01)) for k in range(12)]
    return [*[idle] * (NEEDED + 2), *way, *[way[-1]] * 8]


class Rubbed(Applied):
    """What a calibration does that knows the sheet's lag, m, and nothing else."""

    def __init__(self, slide_lag, _conditions):
        self.slide_lag = slide_lag


RUBBED = Kind("rubbed", "", "", "", learn=float, exclude=lambda *_: None, apply=Rubbed)


def by_skin_file(prepared):
    return prepare(prepared.skin.altered({"touch": {"slide_lag": "10 mm"}}), prepared)


def by_calibration(prepared):
    return prepared.calibrated(RUBBED.of(0.01, prepared.pattern))


def by_both(prepared):
    """The skin file decides."""
    return by_skin_file(prepared).calibrated(RUBBED.of(0.03, prepared.pattern))


def test_a_skin_file_that_says_none_is_believed(prepared, shown):
    rolling = prepare(prepared.skin.altered({"touch": {"slide_lag": "0 mm"}}), prepared)
    plain, rolled = slid(prepared, shown), slid(by_calibration(rolling), shown)
    assert [r.touches[0].detection.x for r in rolled if r.touches] == [
        r.touches[0].detection.x for r in plain if r.touches
    ]


@pytest.mark.parametrize("known", [by_skin_file, by_calibration, by_both])
def test_touches_are_reported_ahead_while_they_slide_and_nowhere_else(prepared, shown, known):
    lagging = known(prepared)
    plain, ahead = slid(prepared, shown), slid(lagging, shown)
    moved = np.array([
        [b.detection.x - a.detection.x, b.detection.y - a.detection.y]
        for one, other in zip(plain, ahead, strict=True)
        for a, b in zip(one.touches, other.touches, strict=True)
    ])  # fmt: skip
    assert len(moved) >= 18
    assert moved[8] == pytest.approx([0.010, 0.0], abs=2e-3)  # it slides along x
    assert not moved[:2].any()
    assert not moved[-5:].any()  # it stands
    told = [event for result in ahead for event in result.events if event.kind == "move"]
    assert told
    for result in ahead:
        places = {t.id: (t.detection.x, t.detection.y) for t in result.touches}
        for event in result.events:
            at = event.touch.detection
            assert event.kind == "release" or (at.x, at.y) == places[event.touch.id]


def test_the_same_frames_give_the_same_touches_to_the_bit(prepared, shown):
    lagging = by_skin_file(prepared)
    first, second = (
        [(t.detection.x, t.detection.y) for r in slid(lagging, shown) for t in r.touches]
        for _ in range(2)
    )
    assert first == second
