"""A locator in another session: aligned without labels, honest where it is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from learning.labelled import RADIUS, ROWS, Floats, held, presses
from tomoskin import Locator, Pattern
from tomoskin.core import DataError
from tomoskin.extras.alignment import SessionAlignment, in_session
from tomoskin.extras.alignment.session_alignment import CHANCE, distance, matched
from tomoskin.learning import TOUCH


@pytest.fixture(scope="module")
def locator() -> Locator:
    return Locator.fit(*presses(150, 0))


def today(n: int, seed: int) -> tuple[Floats, Floats]:
    """Another session: channels of other gains, and twice as much noise."""
    dv, xy = presses(n, seed, noise=0.1)
    return dv * np.exp(0.8 * np.random.default_rng(77).normal(size=dv.shape[1])), xy


def error(told: Floats, xy: Floats) -> float:
    return float(np.linalg.norm(told - xy, axis=1).mean()) / RADIUS


def test_gains_are_found_without_labels(locator: Locator) -> None:
    dv, _ = today(300, 5)
    asked, xy = today(200, 8)
    aligned = in_session(locator, dv)
    told, covariance = aligned.predict(asked)
    assert error(told, xy) < 0.09 < error(locator.predict(asked)[0], xy)
    assert held(told - xy, covariance) > 0.8


def test_frames_that_fit_badly_widen_the_ellipses(locator: Locator) -> None:
    asked, xy = today(300, 8)
    told, covariance = locator.predict(asked)
    assert held(told - xy, covariance) > 0.8
    assert np.median(locator.strangeness(asked)) > 1.5
    same, places = presses(300, 9)
    told, covariance = locator.predict(same)
    assert 0.8 < held(told - places, covariance) < 0.99
    assert 0.6 < np.median(locator.strangeness(same)) < 1.5


def test_an_ellipse_is_never_wider_than_two_skins(locator: Locator) -> None:
    """What is touched may be another skin, which is larger than that of the presses."""
    noise = 40 * np.random.default_rng(0).normal(size=(50, 40))
    deviation = np.sqrt(np.trace(locator.predict(noise)[1], axis1=1, axis2=2) / 2)
    assert deviation.max() <= 2.01 * locator.region.unit


@pytest.mark.parametrize(("count", "channels", "size"), [(30, 40, 1.0), (60, 600, 0.2)])
def test_another_skin_is_strange_and_its_own_later_touches_are_not(
    count: int, channels: int, size: float
) -> None:
    """Though its changes are small, and more channels than presses leave little to compare."""
    rng = np.random.default_rng(7)
    own, other = rng.normal(size=(2, ROWS, channels)) / np.sqrt(ROWS)

    def skin(mixture: Floats, n: int, seed: int) -> tuple[Floats, Floats]:
        dv, xy = presses(n, seed)
        return dv @ mixture, xy

    locator = Locator.fit(*skin(own, count, 0))
    late, _ = skin(own, 200, 5)
    assert np.median(locator.strangeness(late)) < 1.5
    strangers, xy = skin(other, 200, 5)
    told, covariance = locator.predict(size * strangers)
    assert np.median(locator.strangeness(size * strangers)) > 3
    assert held(told - xy, covariance) > 0.8
    assert not SessionAlignment.of(locator, size * strangers).holds


def test_labels_that_are_given_are_kept(locator: Locator) -> None:
    dv, xy = today(120, 5)
    some = np.full(xy.shape, np.nan)
    some[:10] = xy[:10]
    alignment = SessionAlignment.of(locator, dv, some)
    np.testing.assert_allclose(alignment.presses.xy[-120:-110], xy[:10])
    assert not alignment.presses.spreads[-120:-110].any()
    assert (np.trace(alignment.presses.spreads[-110:], axis1=1, axis2=2) > 0).all()
    assert alignment.holds
    assert alignment.missed < 0.2 * RADIUS


def test_what_has_changed_is_said(locator: Locator) -> None:
    alignment = SessionAlignment.of(locator, 3 * today(120, 5)[0])
    words = "; ".join(alignment.findings)
    assert "times as large as in the calibration" in words
    assert "gains have changed" in words
    same = SessionAlignment.of(locator, presses(120, 6)[0])
    assert same.findings == ("the session agrees with the calibration",)
    assert in_session(locator, presses(120, 6)[0]) is locator


def test_labels_of_a_session_as_before_are_added(locator: Locator) -> None:
    dv, xy = presses(60, 6)
    some = np.full(xy.shape, np.nan)
    some[:5] = xy[:5]
    more = in_session(locator, dv, some)
    assert len(more.presses) == len(locator.presses) + 5
    assert more.presses.spread is None


def test_what_is_another_skin_is_not_aligned(locator: Locator) -> None:
    """Each row answers elsewhere than it did: its order has been scrambled."""
    dv = presses(200, 5)[0][:, np.random.default_rng(3).permutation(40)]
    alignment = SessionAlignment.of(locator, dv)
    assert not alignment.holds
    assert "cannot be aligned" in alignment.findings[-1]
    assert in_session(locator, dv) is locator


def test_touches_on_a_part_of_the_skin_are_not_spread_over_all_of_it(locator: Locator) -> None:
    dv, xy = today(900, 5)
    part = (xy[:, 0] > 0.3 * RADIUS) & (xy[:, 1] > 0)
    alignment = SessionAlignment.of(locator, dv[part])
    assert "touch the whole skin" in alignment.findings[-1]
    assert not alignment.holds
    assert in_session(locator, dv[part]) is locator


def test_where_touches_are_in_the_same_session_is_no_change(locator: Locator) -> None:
    """Half of the skin, or mostly its middle: channels are compared where the touches are."""
    dv, xy = presses(400, 6)
    for some in (xy[:, 0] > 0, np.linalg.norm(xy, axis=1) < 0.6 * RADIUS):
        alignment = SessionAlignment.of(locator, dv[some])
        assert alignment.apart < CHANCE
        assert alignment.findings == ("the session agrees with the calibration",)


def test_channels_that_answer_otherwise_are_matched_though_frames_fit() -> None:
    """Each of twelve channels has another law: noise is large enough to hide it from the misfit."""
    law = np.random.default_rng(12).uniform(0.5, 1.6, ROWS)

    def session(n: int, seed: int) -> tuple[Floats, Floats]:
        dv, xy = presses(n, seed, noise=0.3)
        return dv * law, xy

    loose = Locator.fit(*presses(200, 0, noise=0.3))
    alignment = SessionAlignment.of(loose, session(300, 5)[0])
    assert alignment.strangeness < 1.5
    assert alignment.apart > CHANCE
    assert alignment.needed
    assert alignment.holds
    assert len(alignment.presses) == 200
    asked, xy = session(300, 8)
    aligned = alignment.locator(loose)
    assert error(aligned.predict(asked)[0], xy) < error(loose.predict(asked)[0], xy)


def test_a_monotone_law_of_each_channel_is_undone() -> None:
    before = np.random.default_rng(3).normal(size=(400, 3))
    now = np.column_stack([3 * before[:, 0], before[:, 1] ** 3, np.exp(before[:, 2])])
    even = np.full(400, 1 / 400)
    np.testing.assert_allclose(matched(before, now, even), now, rtol=0.2, atol=0.05)
    assert distance(before, now, even) > CHANCE > distance(before, before[::2], even)
    lost = np.where([True, False, False], np.nan, now)
    np.testing.assert_array_equal(matched(before, lost, even)[:, 0], before[:, 0])


def test_a_file_keeps_estimated_labels(tmp_path: Path) -> None:
    dv, _ = today(80, 5)
    pattern = Pattern.adjacent(8)
    aligned = in_session(Locator.fit(*presses(150, 0), pattern=pattern), dv)
    path = tmp_path / "c.npz"
    TOUCH.of(aligned, pattern).write(path)
    again = TOUCH.read(path).model
    asked, _ = today(5, 8)
    for told, first in zip(again.predict(asked), aligned.predict(asked), strict=True):
        np.testing.assert_allclose(told, first)


def test_what_cannot_align_is_refused(locator: Locator) -> None:
    dv, xy = today(60, 5)
    with pytest.raises(DataError, match="at least 50 touches"):
        in_session(locator, dv[:20])
    with pytest.raises(DataError, match="xy of shape"):
        in_session(locator, dv, xy[:5])
    with pytest.raises(DataError, match="shape"):
        in_session(locator, dv[:, :5])


@pytest.mark.data
def test_a_hydrogel_skin_of_the_same_kind_is_aligned_without_labels(data_dir: Path) -> None:
    """Chosen on other skins; the locator alone misses by 15 mm."""
    sets = []
    for name in ("eskin_varsens16_more/cam09_05", "eskin_varsens16/noPattern"):
        with np.load(data_dir / f"{name}.npz") as kept:
            order = np.random.default_rng(31).permutation(len(kept["dv"]))
            sets.append((kept["dv"].astype(float)[order], 1e-3 * kept["xy_mm"][order]))
    (old, places), (new, xy) = sets
    known = Locator.fit(old[:300], places[:300])
    told, covariance = in_session(known, new[:300]).predict(new[-200:])
    assert np.linalg.norm(told - xy[-200:], axis=1).mean() < 6e-3
    assert held(told - xy[-200:], covariance) > 0.8
