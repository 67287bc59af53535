"""A time constant: frames that rest on those before them, by the device's own clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from golden import mismatch
from run.board import AS_TAKEN, pressed, samples_of
from run.test_replay import Recorded, recorded_touches, same, touches_of
from tomoskin.core import FloatArray, Frame
from tomoskin.files.session import SessionReader, replayed
from tomoskin.imaging import Temporal
from tomoskin.model.skin import Skin
from tomoskin.pipeline import FrameResult, Pipeline, Prepared, prepare
from tomoskin.pipeline.following import Following
from tomoskin.pipeline.imaging import Filtered
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES
from tomoskin.sensing.signal import difference

TAU = 0.1
INTERVAL = 0.02
RATE = 250_000.0
TICKS = round(INTERVAL * RATE)


@cache
def filtered(alpha: float | str = 0.05, tau: str = f"{TAU} s") -> Prepared:
    return prepare(
        Skin.load("textile-disc-8").altered(
            {
                "inverse": {"alpha": alpha, "time_constant": tau},
                "signal": AS_TAKEN,
                "touch": {"method": "image"},
            }
        )
    )


@cache
def samples(touched: bool) -> NDArray[np.uint16]:
    where = pressed(filtered(), 0.03, 0.02) if touched else None
    return np.asarray(samples_of(filtered(), where))


def frames(seed: int = 0) -> Iterator[Callable[..., Frame]]:
    """Endless noise: each item makes a frame of samples, at a tick."""
    rng, number = np.random.default_rng(seed), 0
    while True:
        noise = rng.integers(-8, 9, len(samples(False)))
        yield partial(_frame, number, noise)
        number += 1


def _frame(number: int, noise: Any, touched: bool, ticks: int | None = None) -> Frame:
    when = number * TICKS if ticks is None else ticks
    noisy = (samples(touched) + noise).astype(np.uint16)
    return Frame(number, when, 1.0, 1, 0, 0, noisy)  # one host time: all of one read


def settled(prepared: Prepared, source: Iterator[Callable[..., Frame]]) -> Pipeline:
    pipeline = Pipeline(prepared)
    for make in islice(source, REFERENCE_FRAMES):
        pipeline.push(make(False))
    return pipeline


def shown(result: FrameResult | None) -> FrameResult:
    assert result is not None
    return result


def changes(prepared: Prepared, results: Sequence[FrameResult]) -> FloatArray:
    kind = prepared.operator.difference
    return np.array([difference(r.voltages, r.reference, kind) for r in results])


def test_images_are_those_of_the_filter_at_the_times_of_the_device() -> None:
    """Gaps and all: a frame that is lost, a pause, one that is at a rail throughout."""
    source = frames()
    pipeline = settled(filtered(), source)
    ticks = 1000 * TICKS + np.cumsum([1, 1, 2, 1, 30, 1, 1]) * TICKS
    results = [
        shown(pipeline.push(make(n > 2, int(t))))
        for n, (make, t) in enumerate(zip(source, ticks, strict=False))
    ]
    temporal = Temporal(filtered().modes, TAU)  # type: ignore[arg-type]
    for result, dv, t in zip(results, changes(filtered(), results), ticks / RATE, strict=True):
        assert mismatch(result.image.values, temporal.push(dv, float(t)).values) < 1e-6


def test_a_touch_builds_up_and_lasts() -> None:
    source = frames()
    pipeline = settled(filtered(), source)
    still = settled(filtered(tau="0 s"), frames())
    for make in islice(source, 20):
        pipeline.push(make(False))
    first = [shown(pipeline.push(make(True))) for make in islice(source, 40)]
    after = [shown(pipeline.push(make(False))) for make in islice(source, 3)]
    alone = shown(still.push(next(source)(True)))
    depth = [-float(r.image.values.min()) for r in (*first, *after, alone)]
    assert depth[0] < 0.9 * depth[39]
    assert depth[40] > 0.2 * depth[39]
    assert depth[39] >= 0.9 * depth[43]  # at rest it is at least as deep as from one frame
    assert [t.id for t in first[-1].touches] == [1]


def test_a_board_that_starts_again_starts_the_filter_again() -> None:
    source = frames()
    pipeline = settled(filtered(), source)
    for make in islice(source, 10):
        pipeline.push(make(True))
    restarted = shown(pipeline.push(next(source)(True, 5)))
    dv = changes(filtered(), [restarted])[0]
    assert mismatch(restarted.image.values, filtered().operator(dv).values) < 1e-5
    stuck = shown(pipeline.push(next(source)(False, 5)))  # a clock that stands still is no clock
    dv = changes(filtered(), [stuck])[0]
    assert mismatch(stuck.image.values, filtered().operator(dv).values) < 1e-5


def test_a_new_reference_starts_the_filter_again() -> None:
    source = frames()
    pipeline = settled(filtered(), source)
    for make in islice(source, 10):
        pipeline.push(make(True))
    pipeline.take_reference()
    for make in islice(source, REFERENCE_FRAMES):
        pipeline.push(make(False))
    first = shown(pipeline.push(next(source)(False)))
    dv = changes(filtered(), [first])[0]
    assert mismatch(first.image.values, filtered().operator(dv).values) < 1e-5


def test_alpha_that_follows_the_noise_takes_the_filter_with_it() -> None:
    prepared, source = filtered("auto"), frames()
    pipeline = settled(prepared, source)
    for make in islice(source, 50):
        last = shown(pipeline.push(make(False)))
    assert "measured on 20 idle frames" in pipeline.choice.reason
    assert isinstance(pipeline._state, Following)
    tuned = pipeline._state.prepared
    assert tuned.modes is not None
    assert tuned.modes.operator is tuned.operator
    assert np.isfinite(last.image.values).all()


def test_the_floor_is_the_noise_of_the_filtered_images() -> None:
    source = frames(seed=4)
    pipeline = settled(filtered(), source)
    results = [shown(pipeline.push(make(False))) for make in islice(source, 1500)]
    images = np.array([r.image.values for r in results])[200:]
    following = pipeline._state
    assert isinstance(following, Following)
    stage = following._imaging
    assert isinstance(stage, Filtered)
    floor = stage._image_noise(np.inf)
    alone = filtered().image_noise(following.rest.reference)  # type: ignore[union-attr]
    ratio = images.std(axis=0) / floor.sd  # type: ignore[union-attr]
    # the reference tells each row's noise from 20 frames only: as far off as that, over all rows
    assert 0.85 < np.median(ratio) < 1.15
    assert np.median(floor.sd / alone.sd) < 0.97  # type: ignore[union-attr]
    assert not any(r.touches for r in results)


def test_without_a_time_constant_nothing_is_filtered() -> None:
    assert filtered(tau="0 s").modes is None


def test_a_replay_gives_the_same_touches_to_the_bit(tmp_path: Path) -> None:
    path, prepared = tmp_path / "run.mcap", filtered("auto")
    with Recorded(prepared, path) as live:
        live.board.tick = round(INTERVAL * 16_000_000)  # what the board says of its clock
        live.idle(REFERENCE_FRAMES + 5)
        live.touch(0, 12)
        live.idle(3)
        live.touch(1, 12)
    with SessionReader(path) as session:
        got = {r.sequence: touches_of(r) for r in replayed(prepared, session) if r.ready}
    with SessionReader(path) as session:
        own = prepare(session.skin)
        again = {r.sequence: touches_of(r) for r in replayed(own, session) if r.ready}
    recorded = recorded_touches(path)
    assert len(recorded) > 15
    assert all(same(got[n], rows) for n, rows in recorded.items())
    assert all(same(again[n], rows) for n, rows in recorded.items())
    with SessionReader(path) as session:
        plain = replayed(filtered("auto", "0 s"), session)
        assert any(not same(touches_of(r), recorded.get(r.sequence, [])) for r in plain if r.ready)
