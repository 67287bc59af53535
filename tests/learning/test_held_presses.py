"""Frames of a session → presses, and a calibration beside a fit."""

from __future__ import annotations

import numpy as np
import pytest

from learning.labelled import Floats, places, presses
from tomoskin.core import Detection, FloatArray
from tomoskin.learning import FitTrial, HeldPresses, LeftOut, Locator
from tomoskin.learning.kind import Conditions, TouchFit

NOISE, FRAMES, BETWEEN = 0.05, 10, 12


def session(n: int, seed: int, left: float = 0.0) -> tuple[Floats, Floats, Floats, Floats]:
    """Frames and labels of ``n`` presses that come and go, of which each leaves this part in the
    sheet; and what the presses change, and where they are."""
    rng = np.random.default_rng(seed)
    dv, xy = presses(n, seed, noise=0.0)
    rise = np.r_[np.zeros(BETWEEN), 0.3, np.ones(FRAMES - 2), 0.3]
    rest, frames, labels = np.zeros(dv.shape[1]), [], []
    for change, place in zip(dv, xy, strict=True):
        frames += [rest + part * change for part in rise]
        labels += [place if part else np.full(2, np.nan) for part in rise]
        rest = rest + left * change
    data = np.array(frames)
    return data + NOISE * rng.standard_normal(data.shape), np.array(labels), dv, xy


def test_frames_of_one_press_are_one_press() -> None:
    data, labels, dv, xy = session(25, 1)
    held = HeldPresses.of(data, labels)
    assert held.xy == pytest.approx(xy)
    assert held.frames.tolist() == [BETWEEN + k * (BETWEEN + FRAMES) for k in range(25)]
    assert np.std(held.dv - dv) < 0.6 * NOISE, "less noise than a frame, and no frame that rises"


def test_errors_of_frames_of_a_session_leave_whole_presses_out() -> None:
    """Of frames that are taken for presses, others of the same press are left."""
    data, labels, _, _ = session(25, 2)
    known = np.isfinite(labels).all(axis=1)
    held = HeldPresses.of(data, labels)
    of_frames, of_presses = Locator.fit(data[known], labels[known]), Locator.fit(held.dv, held.xy)
    other, place = presses(200, 7, noise=NOISE / 3)
    true = np.linalg.norm(of_presses.predict(other)[0] - place, axis=1).mean()
    assert np.median(of_frames.errors) < 0.6 * true, "as it would be"
    assert 0.7 * true < of_presses.errors.mean() < 2.5 * true


def test_a_press_is_held_against_the_frames_right_before_it() -> None:
    """What earlier presses have left in the sheet is no part of it."""
    data, labels, dv, _ = session(25, 3, left=0.08)
    last = data[np.isfinite(labels).all(axis=1)][FRAMES * 24 + 3]
    assert np.abs(last - dv[24]).max() > 0.3
    assert np.abs(HeldPresses.of(data, labels).dv - dv).max() < 0.12


def test_a_touch_without_a_label_is_no_rest() -> None:
    data, labels, dv, _ = session(2, 4)
    labels[BETWEEN : BETWEEN + FRAMES] = np.nan
    shift = BETWEEN + FRAMES
    joined = np.delete(data, range(shift, shift + BETWEEN), 0)
    held = HeldPresses.of(joined, np.delete(labels, range(shift, shift + BETWEEN), 0))
    assert np.abs(held.dv[0] - dv[1]).max() < 0.12


def test_a_press_without_frames_before_it_or_with_missing_values_is_taken_as_it_is() -> None:
    data = np.ones((6, 4))
    data[:, 1], data[2:, 2] = np.nan, np.nan
    held = HeldPresses.of(data, np.zeros((6, 2)))
    assert np.array_equal(held.dv, [[1.0, np.nan, 1.0, 1.0]], equal_nan=True)
    assert len(HeldPresses.of(data, np.full((6, 2), np.nan)).xy) == 0


class Fitted:
    """Conditions under which a fit finds presses where they are, but for an error."""

    fitted, unrelated = True, False

    def __init__(self, xy: FloatArray, error: float, *, said: float, seed: int = 5) -> None:
        off = error * np.random.default_rng(seed).standard_normal(xy.shape)
        nothing = np.empty(0, dtype=np.int64)
        self.found = [Detection(x, y, said, said, 1e-4, -1.0, nothing) for x, y in xy + off]

    def fitted_presses(self, dv: FloatArray) -> list[Detection | None] | None:
        assert len(dv) == len(self.found)
        return list(self.found)

    def touch_fit(self) -> TouchFit | None:
        return None


@pytest.mark.parametrize(("error", "helps"), [(0.0005, False), (0.03, True)])
def test_a_calibration_is_used_where_it_improves_on_the_fit(error: float, helps: bool) -> None:
    """By presses that were left out; a sure fit that errs little is better alone."""
    dv, xy = presses(40, 6, noise=0.3)
    conditions: Conditions = Fitted(xy, error, said=0.004)
    trial = FitTrial.of(Locator.fit(dv, xy), conditions)
    assert trial is not None
    assert trial.alone == pytest.approx(1.25 * error, rel=0.3)
    assert trial.helps is helps
    assert ("is not used" in trial.text) is not helps


def test_noise_is_no_skin_that_has_changed() -> None:
    said = 0
    for seed in range(12):
        dv, xy = presses(25, 20 + seed)
        said += LeftOut.of(Locator.fit(dv, xy)).drift > 1
    assert said == 0
    dv, xy = presses(60, 50)
    xy[-8:] = places(8, 51)
    assert LeftOut.of(Locator.fit(dv, xy)).drift > 2
