"""A recording without some rows gives the picture of an operator without them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from golden import mismatch
from run.board import AS_TAKEN
from tomoskin.core import DataError
from tomoskin.imaging import Spectrum, choose
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare, reconstruct
from tomoskin.sensing.signal import Recording, Reference

SKINS = {
    kind: Skin.load("textile-disc-8").altered(
        {"inverse": {"alpha": 0.1, "difference": kind}, "signal": AS_TAKEN}
    )
    for kind in ("plain", "normalised")
}
ROWS = [3, 17, 30]


def recording(pattern: Pattern, voltages: np.ndarray, *, is_change: bool = False) -> Recording:
    return Recording(
        voltages=voltages,
        drive=pattern.drive,
        measure=pattern.measure,
        time=np.arange(len(voltages)) / 10,
        reference=None,
        labels=None,
        is_change=is_change,
        source="a recording",
    )


@pytest.mark.parametrize("kind", SKINS)
@pytest.mark.parametrize("scale", [1.0, 1.3])
def test_images_are_those_without_the_rows(kind: str, scale: float) -> None:
    prepared = prepare(SKINS[kind])
    model = prepared.operator.reference
    change = 1e-3 * np.random.default_rng(0).standard_normal((4, 40)) * np.abs(model)
    voltages = scale * (model + change)
    voltages[:, ROWS] = np.nan
    idle = np.tile(scale * model, (3, 1))
    found = reconstruct(prepared, recording(prepared.pattern, voltages), idle)
    assert found.rows_left_out.tolist() == ROWS
    assert len(found.frames) == 4
    dv = scale * change if kind == "plain" else change / np.abs(model)
    expected = prepared.operator.without(ROWS)
    for image, data in zip(found.images, dv, strict=True):
        assert mismatch(image, expected(data).values) < 1e-4  # in single precision


def test_differences_without_the_rows() -> None:
    prepared = prepare(SKINS["plain"])
    dv = np.random.default_rng(0).standard_normal((3, 40))
    broken = dv.copy()
    broken[:, ROWS] = np.inf
    given = recording(prepared.pattern, broken, is_change=True)
    found = reconstruct(prepared, given, None)
    assert mismatch(found.images[0], prepared.operator.without(ROWS)(dv[0]).values) < 1e-4
    assert np.isinf(given.voltages[:, ROWS]).all()  # what was given stays as it was


def test_rows_that_only_the_idle_frames_lack() -> None:
    prepared = prepare(SKINS["plain"])
    voltages = np.tile(prepared.operator.reference, (3, 1))
    idle = voltages.copy()
    idle[:, ROWS] = np.nan
    found = reconstruct(prepared, recording(prepared.pattern, voltages), idle)
    assert found.rows_left_out.tolist() == ROWS
    assert np.abs(found.images).max() < 1e-9


def touched(prepared: Prepared, count: int) -> np.ndarray:
    """Frames of a touch somewhere, with the read-out's noise."""
    rng = np.random.default_rng(2)
    images = np.where(rng.random((count, len(prepared.mesh.cells))) < 0.02, -0.3, 0.0)
    dv = images @ prepared.problem.jacobian.T
    return np.asarray(dv + prepared.readout.noise * rng.standard_normal(dv.shape))


def test_rows_that_a_frame_lacks_do_not_count_in_it() -> None:
    prepared = prepare(SKINS["plain"])
    dv = touched(prepared, 5)
    broken = dv.copy()
    broken[:, 3] = np.nan  # dead
    broken[2, [17, 30]] = np.nan
    broken[4, 5:25] = np.nan  # more than half of the others
    found = reconstruct(prepared, recording(prepared.pattern, broken, is_change=True), None)
    assert found.frames.tolist() == [0, 1, 2, 3, 4]
    assert found.left_out.tolist() == [4]
    assert found.rows_missing.tolist() == [0, 0, 2, 0, 20]
    for image, data, rows in zip(found.images, dv, ([3], [3], [3, 17, 30], [3]), strict=False):
        assert mismatch(image, prepared.operator.without(rows)(data).values) < 1e-4


@pytest.mark.parametrize("rule", [None, "model-error", "noise-figure"])
def test_alpha_is_chosen_without_the_dead_rows(rule: str | None) -> None:
    """As on a skin whose pattern never had them."""
    prepared = prepare(SKINS["plain"].altered({"inverse": {"alpha": "auto"}}))
    model, rng = prepared.operator.reference, np.random.default_rng(3)
    idle = model + 3 * prepared.readout.noise * rng.standard_normal((20, 40))
    values = model + touched(prepared, 6)
    values[:, :9] = np.nan
    found = reconstruct(prepared, recording(prepared.pattern, values), idle, rule=rule)
    left = prepared.problem.without(np.arange(9))
    noise = Reference.of(idle[:, 9:]).noise
    expected = choose(Spectrum.of(left), rule or "light-touch", noise)
    assert found.choice.alpha == pytest.approx(expected.alpha, rel=1e-9)
    whole = choose(Spectrum.of(prepared.problem), "light-touch", Reference.of(idle).noise)
    if rule is None:
        assert abs(np.log(found.choice.alpha / whole.alpha)) > 0.01


def test_dead_rows_say_nothing_of_how_well_a_recording_agrees() -> None:
    """Agreement of the living rows alone, however wrong the others would be."""
    prepared = prepare(SKINS["plain"])
    values = np.tile(prepared.operator.reference, (3, 1)) * np.random.default_rng(0).uniform(
        0.7, 1.4, 40
    )
    broken = values.copy()
    broken[:, ROWS] = np.nan
    found = reconstruct(prepared, recording(prepared.pattern, broken), broken)
    a, b = np.delete(values[0], ROWS), np.delete(prepared.operator.reference, ROWS)
    assert found.agreement == pytest.approx(a @ b / np.linalg.norm(a) / np.linalg.norm(b))


def test_untouched_frames_that_lack_rows_are_not_averaged() -> None:
    prepared = prepare(SKINS["plain"])
    idle = np.tile(prepared.operator.reference, (3, 1))
    idle[1, 7] = np.nan
    idle[1] *= 1.5
    found = reconstruct(prepared, recording(prepared.pattern, idle[[0, 2]]), idle)
    assert np.abs(found.images).max() < 1e-9
    idle[:, [4, 5, 6]] = np.where(np.eye(3, dtype=bool), np.nan, idle[:, [4, 5, 6]])
    with pytest.raises(DataError, match="no untouched frame has finite values in all rows"):
        reconstruct(prepared, recording(prepared.pattern, idle[[0, 2]]), idle)


def test_rows_in_another_order_are_refused_by_identity() -> None:
    prepared = prepare(SKINS["plain"])
    voltages = np.tile(prepared.operator.reference, (3, 1))
    given = recording(prepared.pattern, voltages)
    order = np.roll(np.arange(40), 1)
    other = replace(given, drive=given.drive[order], measure=given.measure[order])
    with pytest.raises(DataError, match=f"expected data of pattern {prepared.pattern.identity}"):
        reconstruct(prepared, other, voltages)


def test_values_that_are_not_known_tell_nothing_of_their_sum_either() -> None:
    """A cut wire: readings at a rail are no numbers in a file of voltages, as they are live."""
    prepared = prepare(Skin.load("textile-disc-16"))
    pattern, rng = prepared.pattern, np.random.default_rng(4)
    square = ((prepared.mesh.centroids[:, :2] - (0.03, 0.02)) ** 2).sum(axis=1)
    sigma = prepared.skin.conductivity * (1 - 0.5 * np.exp(-square / 0.014**2))
    values = np.tile(prepared.operator.reference, (32, 1))
    values[20:] = prepared.model.at(sigma).voltages
    values += 0.5 * prepared.readout.noise * rng.standard_normal(values.shape)
    lost = (pattern.drive == 4).any(axis=1) | (pattern.measure == 4).any(axis=1)
    values[25:, lost] = np.nan
    timed = replace(recording(pattern, values), time=0.2 * np.arange(32.0))
    found = reconstruct(prepared, timed, range(20))
    places = [(touch.detection.x, touch.detection.y) for (touch,) in found.touches[25:]]
    assert math.dist(np.mean(places, axis=0), (0.03, 0.02)) < 0.0015
