"""The locator on maps that are known, and on one public skin."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from learning.labelled import RADIUS, ROWS, Floats, held, places, presses
from tomoskin import Locator, Pattern, Skin
from tomoskin.core import DataError
from tomoskin.learning import LeftOut, Presses, growth_of_errors
from tomoskin.learning.touch import maps
from tomoskin.learning.touch.gaussian_process import Basis, Likeness, moments
from tomoskin.learning.touch.maps import ResponseMaps
from tomoskin.learning.touch.posterior import POWERS, GridLikelihood, pooled, powers_of
from tomoskin.sensing.segment import Region


@pytest.fixture(scope="module")
def locator() -> Locator:
    return Locator.fit(*presses(80, 0))


def test_places_are_found_and_ellipses_hold_what_they_say(locator: Locator) -> None:
    dv, xy = presses(400, 5)
    told, covariance = locator.predict(dv)
    error = told - xy
    assert told.shape == (400, 2)
    assert covariance.shape == (400, 2, 2)
    assert np.linalg.norm(error, axis=1).mean() < 0.05 * RADIUS
    assert 0.82 < held(error, covariance) < 0.97
    assert locator.errors.mean() == pytest.approx(np.linalg.norm(error, axis=1).mean(), rel=0.5)


@pytest.mark.parametrize("n", [10, 40])
def test_presses_of_one_force_are_known_from_soft_and_hard_ones(n: int) -> None:
    """By their sizes, wherever they are, or by their labels: what is promised holds for these."""
    dv, xy = presses(n, 0)
    force = np.where(np.arange(n) % 2, 1.0, 3.0)
    assert LeftOut.of(Locator.fit(dv, xy)).one_force
    assert not LeftOut.of(Locator.fit(dv * force[:, None], xy)).one_force
    assert not LeftOut.of(Locator.fit(dv, xy, strength=force)).one_force


def test_more_presses_make_it_better() -> None:
    dv, xy = presses(300, 5)
    mean = [
        np.linalg.norm(Locator.fit(*presses(n, 0)).predict(dv)[0] - xy, axis=1).mean()
        for n in (10, 30, 80)
    ]
    assert mean[0] > 1.5 * mean[1]
    assert mean[1] > 1.1 * mean[2]
    assert mean[0] < 0.3 * RADIUS


def test_the_posterior_of_maps_of_known_noise_holds_what_it_says() -> None:
    """Features drawn from the model itself: at temperature 1, the ellipses are exact."""
    rng = np.random.default_rng(3)
    xy = places(360, 1) / RADIUS
    likeness = Likeness(0.45)
    basis = Basis.of(likeness, xy)
    drawn = basis(xy) @ rng.normal(size=(len(basis.root.T), 6))
    features = drawn + 0.3 * rng.normal(size=drawn.shape)
    learnt = ResponseMaps.of(likeness, xy[:300], features[:300], np.eye(features.shape[1]))
    side = np.linspace(-1.1, 1.1, 45)
    grid = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    grid = grid[np.linalg.norm(grid, axis=1) < 1.0]
    likelihood = GridLikelihood.of(learnt, grid)
    log_likelihood = likelihood.of_misfit(likelihood.misfit(features[300:]))
    mean, covariance = moments(pooled([log_likelihood], np.ones(1)), grid)
    assert held(mean - xy[300:], covariance) > 0.8


def test_the_powers_of_a_pool_are_those_at_which_left_out_presses_are_likeliest() -> None:
    """Every pair is tried one by one here."""
    rng = np.random.default_rng(4)
    grid, xy = places(90, 3) / RADIUS, places(40, 2) / RADIUS
    away = ((xy[:, None] - grid) ** 2).sum(axis=2)
    parts = [-(s * away) + rng.normal(0, 3, away.shape) for s in (10.0, 40.0)]
    there = np.arange(len(xy)), away.argmin(axis=1)
    tried = np.array(list(product(np.append(0.0, POWERS), repeat=2)))
    score = [np.log(pooled(parts, powers)[there] + 1e-6).sum() for powers in tried]
    assert powers_of(parts, grid, xy).tolist() == tried[int(np.argmax(score))].tolist()


@pytest.mark.parametrize("n", [25, 200])
def test_learning_solves_few_problems_as_large_as_all_rows(
    n: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The length scale is told by some rows: six maps of all are learnt, in a few steps each."""
    sizes: list[int] = []

    def counted(a: Floats, *others: Floats, **options: object) -> tuple[Floats, Floats]:
        sizes.append(len(a))
        values, vectors = eigh(a, *others, **options)
        return values, vectors

    monkeypatch.setattr(maps, "eigh", counted)
    dv, xy = presses(n, 0)
    Locator.fit(np.hstack([dv, dv[:, ::-1] + dv, dv**3]), xy)
    assert sizes.count(max(sizes)) <= 60


def test_the_order_of_the_rows_does_not_matter(locator: Locator) -> None:
    order = np.random.default_rng(0).permutation(ROWS)
    dv, xy = presses(80, 0)
    other = Locator.fit(dv[:, order], xy)
    frames = presses(50, 5)[0]
    ours, theirs = locator.predict(frames)[0], other.predict(frames[:, order])[0]
    assert np.abs(ours - theirs).max() < 0.01 * RADIUS


def test_rows_that_never_change_are_left_out(locator: Locator) -> None:
    dv, xy = presses(80, 0)
    silent = np.full((80, 3), 7.0)
    other = Locator.fit(np.hstack([dv, silent]), xy)
    frames = presses(50, 5)[0]
    wider = np.hstack([frames, np.full((50, 3), -1e6)])
    np.testing.assert_allclose(other.predict(wider)[0], locator.predict(frames)[0], atol=1e-9)


def test_missing_values_of_a_frame_are_left_out(locator: Locator) -> None:
    dv, xy = presses(200, 5)
    broken = dv.copy()
    broken[np.random.default_rng(0).random(dv.shape) < 0.2] = np.nan
    broken[0, :3] = np.inf
    whole = np.linalg.norm(locator.predict(dv)[0] - xy, axis=1).mean()
    left = np.linalg.norm(locator.predict(broken)[0] - xy, axis=1).mean()
    assert left < 2 * whole


def test_a_row_that_rails_now_and_then_does_little_harm() -> None:
    dv, xy = presses(80, 0)
    wild = np.random.default_rng(0).random(dv.shape) < 0.02
    spoilt = Locator.fit(np.where(wild, 500.0, dv), xy)
    frames, where = presses(200, 5)
    assert np.linalg.norm(spoilt.predict(frames)[0] - where, axis=1).mean() < 0.1 * RADIUS


def test_added_presses_are_as_good_as_those_of_the_first_hour() -> None:
    dv, xy = presses(110, 0)
    first, batch = Locator.fit(dv[:90], xy[:90]), Locator.fit(dv, xy)
    grown = first.updated(dv[90:], xy[90:])
    frames, where = presses(200, 5)
    before, after, anew = (
        np.linalg.norm(known.predict(frames)[0] - where, axis=1).mean()
        for known in (first, grown, batch)
    )
    assert anew < before
    assert after == anew
    assert len(grown.presses) == 110
    np.testing.assert_array_equal(grown.predict(frames)[1], batch.predict(frames)[1])


def test_it_is_said_when_more_presses_make_it_worse() -> None:
    """The newer ones have labels of their neighbours: a cable of the robot was left loose."""
    dv, xy = presses(80, 0)
    assert growth_of_errors(Locator.fit(dv, xy)) == 1.0
    older = Locator.fit(dv[:40], xy[:40])
    assert growth_of_errors(older.updated(dv[40:], xy[40:]), older) == 1.0
    shifted = np.vstack([xy[:40], np.roll(xy[40:], 1, axis=0)])
    assert growth_of_errors(Locator.fit(dv, shifted)) > 1.1


def test_contradicting_labels_are_named() -> None:
    dv, xy = presses(80, 0)
    dv[33], xy[33] = dv[12], xy[12] + 0.05
    xy[60] = -xy[60] + 0.02
    xy[7] = -xy[7]
    remarks = Locator.fit(dv, xy).remarks
    named = {remark.row for remark in remarks}
    assert any("same data as press 12" in r.reason for r in remarks if r.row == 33)
    assert {7, 60} & named
    assert named <= {7, 12, 33, 60}


def test_clean_labels_are_not_suspected(locator: Locator) -> None:
    assert locator.remarks == ()


def test_the_next_press_is_wanted_where_there_was_none() -> None:
    dv, xy = presses(120, 0)
    known = xy[:, 0] < 0.02
    skin_edge = np.abs(xy) @ [1, 0] > 0.09  # the hull still reaches to the right
    some = known | skin_edge
    wanted = Locator.fit(dv[some], xy[some]).next_place()
    assert wanted[0] > 0.01


def test_strength_follows_labels_and_without_them_the_usual_press() -> None:
    dv, xy = presses(120, 0, noise=0.01)
    force = np.random.default_rng(4).uniform(0.5, 2.0, 120)
    frames, _ = presses(60, 5, noise=0.01)
    labelled = Locator.fit(dv * force[:, None], xy, strength=force)
    np.testing.assert_allclose(labelled.strength(1.5 * frames), 1.5, rtol=0.35)
    assert np.median(labelled.strength(1.5 * frames)) == pytest.approx(1.5, rel=0.08)
    plain = Locator.fit(dv, xy)
    assert np.median(plain.strength(2 * frames)) == pytest.approx(2.0, rel=0.08)


def test_progress_goes_from_nothing_to_all() -> None:
    seen: list[tuple[float, float]] = []
    Locator.fit(*presses(20, 0), progress=lambda done, total: seen.append((done, total)))
    assert seen[0][0] == 0
    assert seen[-1][0] == seen[-1][1]
    assert seen == sorted(seen)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda dv, xy: (dv[:4], xy[:4]), "at least 6"),
        (lambda dv, xy: (dv, xy[:5]), "shape"),
        (lambda dv, xy: (dv, np.where(np.arange(30)[:, None] == 3, np.nan, xy)), "press 3"),
        (lambda dv, xy: (dv, xy * [1, 0]), "one line"),
        (lambda dv, xy: (np.ones_like(dv), xy), "change"),
        (lambda dv, xy: (dv * 1j, xy), "real"),
        (lambda dv, xy: (dv[None], xy), "shape"),
    ],
)
def test_what_cannot_be_learnt_from_is_refused(change, words: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(DataError, match=words):
        Locator.fit(*change(*presses(30, 0)))


def test_labels_outside_the_skin_are_refused() -> None:
    skin = Skin.load("textile-disc-8")
    n_meas = skin.pattern().n_meas
    dv = np.random.default_rng(0).normal(size=(20, n_meas))
    xy = 0.5 * places(20, 0)
    with pytest.raises(DataError, match="outside the skin") as caught:
        Locator.fit(dv, 10 * xy, skin=skin)
    assert "metres" in str(caught.value)
    with pytest.raises(DataError, match="no label within 10 m") as caught:
        Locator.fit(dv, 1e3 * xy)  # millimetres
    assert "metres" in str(caught.value)
    with pytest.raises(DataError, match="shape"):
        Locator.fit(dv[:, 1:], xy, skin=skin)


def test_how_far_outside_is_measured_from_the_outline() -> None:
    """A press 3 mm beyond the short end of a long skin is as much at its rim as one at its side."""
    region = Region(np.array([[-0.2, -0.02], [0.2, -0.02], [0.2, 0.02], [-0.2, 0.02]]))
    inside = [[0.1, 0.01], [0.0, -0.01], [-0.1, 0.01]] * 2
    rims = [[0.203, 0.0], [0.0, 0.023], [-0.202, -0.022]]
    np.testing.assert_allclose(
        region.beyond(np.array([*rims, [0.1, 0.01]])), [0.003, 0.003, 0.002 * np.sqrt(2), 0]
    )
    for place in rims:
        Presses.checked(np.ones((7, 2)), [*inside, place]).within(region)
    for place in ([0.208, 0.0], [0.0, 0.028]):
        with pytest.raises(DataError, match="press 6"):
            Presses.checked(np.ones((7, 2)), [*inside, place]).within(region)


def test_frames_of_another_pattern_are_refused() -> None:
    pattern = Pattern.adjacent(8)
    xy = places(20, 0)
    dv = np.random.default_rng(0).normal(size=(20, pattern.n_meas))
    locator = Locator.fit(dv, xy, pattern=pattern)
    with pytest.raises(DataError, match="shape"):
        locator.predict(dv[:, 1:])
    with pytest.raises(DataError, match="frame 1"):
        locator.predict(np.vstack([dv[0], np.full(pattern.n_meas, np.nan)]))


@pytest.mark.data
def test_a_hundred_presses_of_a_public_skin(data_dir: Path) -> None:
    """Patterned hydrogel, 40 mm in radius: a plain process gets 3.5 mm and more here."""
    with np.load(data_dir / "eskin_varsens16" / "parallel.npz") as kept:
        dv, xy = kept["dv"].astype(float), 1e-3 * kept["xy_mm"]
    order = np.random.default_rng(0).permutation(len(dv))
    learnt, tested = order[:100], order[-300:]
    locator = Locator.fit(dv[learnt], xy[learnt])
    told, covariance = locator.predict(dv[tested])
    error = told - xy[tested]
    assert np.linalg.norm(error, axis=1).mean() < 3.2e-3
    assert 0.82 < held(error, covariance) < 0.97


@pytest.mark.data
def test_a_few_presses_align_an_old_calibration_to_another_session(data_dir: Path) -> None:
    """Two sessions of one kind of skin: 12 mm as it is, 18 mm from ten new presses alone."""
    folder = data_dir / "eskin_hydrogel_round"
    (old, there), (new, here) = (
        _differences(folder / f"round16_{name}.npz") for name in ("single550", "single500_ohmc")
    )
    locator = Locator.fit(old[:200], there[:200])
    asked, truth = new[200:300], here[200:300]
    aligned = locator.updated(new[:10], here[:10])
    before, after = (
        np.linalg.norm(known.predict(asked)[0] - truth, axis=1).mean()
        for known in (locator, aligned)
    )
    assert after < 0.75 * before


def _differences(path: Path) -> tuple[Floats, Floats]:
    with np.load(path) as kept:
        return kept["v_down"].astype(float) - kept["v_up"], 1e-3 * kept["xy_mm"].astype(float)


def test_presses_in_an_order_are_left_out_here_and_there() -> None:
    """Row by row over the skin, a stretch of presses is a part of the skin that no other knows."""
    dv, xy = presses(120, 0)
    order = np.lexsort((xy[:, 0], np.round(xy[:, 1] / 0.02)))
    in_rows, at_random = Locator.fit(dv[order], xy[order]), Locator.fit(dv, xy)
    assert in_rows.errors.mean() < 1.3 * at_random.errors.mean()
