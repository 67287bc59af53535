"""What is prepared anew in a thread, where measurements are many: taken at a counted frame."""

from __future__ import annotations

import time
from collections.abc import Iterator
from threading import Event

import numpy as np
import pytest

from run.board import AS_TAKEN, pressed, samples_of
from tomoskin.core import Frame
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, aside, prepare
from tomoskin.pipeline.aside import Aside, frames_aside

NEEDED, FRAMES = 20, 150


@pytest.fixture(scope="module")
def skin() -> Prepared:
    auto = {"inverse": {"alpha": "auto"}, "touch": {"method": "fit"}, "signal": AS_TAKEN}
    made = prepare(Skin.load("textile-disc-8").altered(auto))
    made.warm_up()
    return made


def frames(prepared: Prepared) -> Iterator[Frame]:
    """Loud idle frames, then a press in as much noise."""
    random = np.random.default_rng(2)
    sd = 4 * prepared.readout.noise / prepared.readout.volts_per_count
    idle, touched = samples_of(prepared), samples_of(prepared, pressed(prepared, 0.03, 0.02))
    for number in range(FRAMES):
        samples = idle if number < 2 * FRAMES // 3 else touched
        noisy = np.round(samples + sd * random.standard_normal(len(samples)))
        yield Frame(number, 25_000 * number, 0.1 * number, 1, 0, 0, noisy.astype(np.uint16))


def followed(prepared: Prepared) -> tuple[list[FrameResult], Pipeline]:
    pipeline = Pipeline(prepared, reference_frames=NEEDED)
    results = [pipeline.push(frame) for frame in frames(prepared)]
    return [result for result in results if result is not None], pipeline


def test_a_replay_says_the_same_to_the_bit_however_long_the_thread_takes(
    skin: Prepared, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(aside, "MOST_MEASUREMENTS", 8)
    monkeypatch.setattr(aside, "_SECONDS", 1.0 / skin.pattern.n_meas**3)
    quick, pipeline = followed(skin)
    run = Aside._run

    def slow(self: Aside[object], work: object) -> None:
        time.sleep(0.2)
        run(self, work)  # type: ignore[arg-type]

    monkeypatch.setattr(Aside, "_run", slow)
    late, other = followed(skin)
    assert pipeline.choice is not skin.choice, "something was prepared anew"
    assert pipeline.choice.alpha == other.choice.alpha
    assert sum(len(result.touches) for result in quick) > 20
    for one, two in zip(quick, late, strict=True):
        assert [repr(touch) for touch in one.touches] == [repr(touch) for touch in two.touches]


def test_no_frame_but_the_one_that_takes_it_waits_for_it() -> None:
    go_on = Event()

    def work() -> str:
        assert go_on.wait(60)
        return "done"

    made = Aside(work, 3)
    assert [made.is_due() for _ in range(2)] == [False, False]
    go_on.set()
    assert made.is_due()
    assert made.result() == "done"


def test_what_the_work_raises_is_raised_where_it_is_taken() -> None:
    def work() -> None:
        raise ValueError("no sheet")

    with pytest.raises(ValueError, match="no sheet"):
        Aside(work, 1).result()


def test_few_measurements_come_in_pieces_and_many_in_a_thread() -> None:
    assert frames_aside(208, 0.02) == 0
    assert frames_aside(928, np.nan) == 0
    assert frames_aside(928, 0.2) > 10
    assert frames_aside(928, 0.02) > 10 * frames_aside(928, 0.2) - 10
