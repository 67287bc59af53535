"""Samples of regions: their geometry, their law before and after data, and the mask to give."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from shapes import box, disc
from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse import (
    Observation,
    ShapeImaging,
    ShapePosterior,
    ShapeSampling,
    SimilarityWindows,
    most_similar,
)
from tomoskin.inverse.iterative.observation import Whitened
from tomoskin.inverse.iterative.shapes import LESS, MORE
from tomoskin.inverse.posterior.packing import Covers, Packing
from tomoskin.inverse.posterior.placement import PlacedRegions
from tomoskin.inverse.posterior.sampling import walk
from tomoskin.inverse.posterior.search import search
from tomoskin.inverse.posterior.stars import N_PARAMETERS, StarPrior
from tomoskin.pattern import Pattern

SIZE = 0.025


def prior() -> StarPrior:
    return StarPrior.on(disc(16, 700), SIZE)


def covers() -> Covers:
    return Covers(prior(), disc(16, 700))


def stars(n: int, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).standard_normal((n, N_PARAMETERS))


# Geometry.


def test_a_round_region_is_a_disc_of_its_radius() -> None:
    star = prior().ellipse(np.array([0.02, -0.03]), 0.018)[None]
    angle = np.linspace(0, 6, 7)
    rim = np.array([0.02, -0.03]) + 0.018 * np.column_stack([np.cos(angle), np.sin(angle)])
    assert prior().level(star, rim) == pytest.approx(np.zeros((1, 7)), abs=1e-12)
    assert prior().areas(star) == pytest.approx(np.pi * 0.018**2)
    assert prior().radii(star) == pytest.approx(0.018)
    assert prior().centres(star) == pytest.approx(np.array([[0.02, -0.03]]))


def test_area_is_that_of_the_points_inside() -> None:
    step = np.linspace(-0.3, 0.3, 601)
    raster = np.stack(np.meshgrid(step, step), axis=-1).reshape(-1, 2)
    some = stars(3)
    counted = (prior().level(some, raster) > 0).sum(axis=1) * 1e-6
    assert prior().areas(some) == pytest.approx(counted, rel=0.02)


def test_slope_is_the_derivative_of_the_level() -> None:
    some, points = stars(2), np.random.default_rng(1).normal(0.0, 0.05, (5, 2))
    slope, h = prior().slope(some, points), 1e-6
    for k in range(N_PARAMETERS):
        step = np.zeros(N_PARAMETERS)
        step[k] = h
        change = prior().level(some + step, points) - prior().level(some - step, points)
        assert slope[:, k] == pytest.approx(change / (2 * h), rel=1e-5, abs=1e-7)


def test_chain_is_the_derivative_of_the_contrast() -> None:
    """Also where two regions of a kind overlap."""
    packing = Packing(covers(), (LESS, MORE, MORE), 0.98)
    latent = 0.7 * stars(3, seed=4).ravel()
    step, h = stars(3, seed=5).ravel(), 1e-6
    slope = (packing.contrast(latent + h * step) - packing.contrast(latent - h * step)) / (2 * h)
    assert packing.chain(latent, np.eye(len(slope))) @ step == pytest.approx(
        slope, rel=1e-4, abs=1e-5
    )


def test_regions_that_meet_or_reach_out_cost_more() -> None:
    """Two kinds more than one kind, and apart nothing."""

    def cost(kinds: tuple[int, ...], *centres: tuple[float, float]) -> float:
        rows = [prior().ellipse(np.array(c), SIZE) for c in centres]
        return Packing(covers(), kinds, 0.98).crowding(np.concatenate(rows))

    apart = cost((LESS, MORE), (-0.05, 0.0), (0.04, 0.0))
    alike = cost((MORE, MORE), (-0.01, 0.0), (0.01, 0.0))
    other = cost((LESS, MORE), (-0.01, 0.0), (0.01, 0.0))
    assert apart < 0.1
    assert 1.0 < alike < other / 4
    assert cost((LESS,), (0.06, 0.0)) < 0.1
    assert cost((LESS,), (0.095, 0.0)) > 20.0


# The law of the regions.


def no_data(expected: float) -> PlacedRegions:
    """Voltages that say nothing."""
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    data = Whitened(np.zeros(1), np.zeros((1, 40)), 0.0, 0)
    return PlacedRegions(model, data, StarPrior.on(disc(), 0.01), 0.98, 1.0, 0.1, expected)


def test_without_data_the_walk_samples_what_was_expected() -> None:
    """Number of regions, their kinds and sizes, and the background.

    Regions that crowd are less probable: independent draws, weighted by that, give the same.
    """
    regions, rng = no_data(1.0), np.random.default_rng(7)
    walked = list(walk(regions.place((), np.zeros(1)), 1500, rng))[100:]
    counts = np.array([len(sample.kinds) for sample in walked])
    radii = np.concatenate([sample.stars[:, 2] for sample in walked])
    weights, drawn, sizes = [], rng.poisson(1.0, 600), []
    for n in drawn:
        kinds = tuple(int(k) for k in rng.choice((LESS, MORE), n))
        some = rng.standard_normal((n, N_PARAMETERS))
        weights.append(np.exp(-0.5 * Packing(regions.covers, kinds, 0.98).crowding(some.ravel())))
        sizes.append(some[:, 2].sum())
    wanted = np.average(drawn, weights=weights)
    assert counts.mean() == pytest.approx(wanted, abs=0.2)
    assert (counts == 0).mean() == pytest.approx(np.average(drawn == 0, weights=weights), abs=0.12)
    assert radii.mean() == pytest.approx(np.average(sizes, weights=weights) / wanted, abs=0.35)
    assert np.concatenate([sample.kinds for sample in walked]).mean() == pytest.approx(1.5, abs=0.2)
    assert np.std([sample.unknowns[-1] for sample in walked]) == pytest.approx(0.1, rel=0.3)


def test_evidence_of_the_medium_alone_is_the_integral() -> None:
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    v = model.solve(1.1).voltages
    data = Observation.of(v, 0.1 * np.abs(v)).whitened(40)
    regions = PlacedRegions(model, data, StarPrior.on(disc(), SIZE), 0.98, 1.0, 0.2, 2.0)
    best = regions.fitted(regions.place((), np.zeros(1)), 8)
    at = np.linspace(-0.5, 0.7, 241)
    density = [np.exp(-0.5 * regions.place((), np.array([x])).objective) for x in at]
    integral = np.trapezoid(density, at) / (0.2 * np.sqrt(2 * np.pi))
    assert best.unknowns[0] == pytest.approx(np.log(1.1), abs=0.01)
    assert best.evidence == pytest.approx(np.log(integral), abs=0.02)


# Regions from voltages.


def truth(points: FloatArray) -> np.ndarray:
    """Two discs that conduct less, close together, and one that conducts more."""
    places = {LESS: [(-0.05, 0.02), (-0.02, -0.045)], MORE: [(0.05, 0.01)]}
    labels = np.zeros(len(points), int)
    for kind, centres in places.items():
        for centre in centres:
            labels[np.linalg.norm(points - np.array(centre), axis=1) < 0.024] = kind
    return labels


@cache
def observation(excluded: int = 0) -> Observation:
    """Of a finer mesh; what touches so many electrodes is left out."""
    fine = disc(16, 2500)
    sigma = np.array([1.0, 0.01, 100.0])[truth(fine.centroids)]
    pattern = Pattern.adjacent(16)
    v = ForwardModel(fine, pattern, 0.01).solve(sigma).voltages
    noise = 0.02 * np.abs(v) + 1e-3 * np.abs(v).max()
    v = v + 0.5 * noise * np.random.default_rng(0).standard_normal(len(v))
    touched = (np.hstack([pattern.drive, pattern.measure]) < excluded).any(axis=1)
    return Observation.of(v, np.where(touched, np.inf, noise))


@cache
def posterior(excluded: int = 0) -> ShapePosterior:
    model = ForwardModel(disc(16, 700), Pattern.adjacent(16), 0.01)
    seen = observation(excluded)
    start = ShapeImaging(model, 0.04)(seen, 1.0)
    return ShapeSampling(model, SIZE, steps=120, samples=30)(seen, start)


def test_regions_are_told_apart_and_found() -> None:
    points = disc(16, 700).centroids
    assert sorted(posterior().likeliest.kinds) == [LESS, LESS, MORE]
    given = posterior().probability(points)
    assert given.sum(axis=1) == pytest.approx(np.ones(len(points)))
    assert (given.argmax(axis=1) == truth(points)).mean() > 0.96


def test_it_is_sure_where_it_is_right_and_unsure_where_nothing_was_read() -> None:
    """Entropy is high at outlines only, and in the dark of electrodes that are left out."""
    points = disc(16, 700).centroids
    bits, dark = posterior().entropy(points), posterior(6).entropy(points)
    wrong = posterior().probability(points).argmax(axis=1) != truth(points)
    assert bits[wrong].mean() > 4 * bits.mean()
    # E1 to E6 stand clockwise from the top: the right half
    unseen = points @ np.array([0.8, 0.3]) > 0.04
    assert dark[unseen].mean() > 2.0 * bits[unseen].mean()
    assert bits.min() == 0.0 <= bits.max() <= np.log2(3) + 1e-9


def test_the_same_seed_gives_the_same_samples() -> None:
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    v = model.solve(1.0).voltages
    seen = Observation.of(v, 0.05 * np.abs(v))
    start = ShapeImaging(model, 0.04)(seen, 1.0)
    sampling = ShapeSampling(model, SIZE, steps=40, samples=10, rounds=0)
    one, again, other = (sampling(seen, start, seed=k) for k in (1, 1, 2))
    assert [s.objective for s in one.samples] == [s.objective for s in again.samples]
    assert [s.objective for s in one.samples] != [s.objective for s in other.samples]


def test_a_walk_of_less_noise_stays_nearer_the_likeliest() -> None:
    """Its regions' law is that of the noise it is given."""
    begin = posterior().likeliest
    near, far = (
        [
            sample.unknowns
            for sample in walk(begin.with_noise(noise), 60, np.random.default_rng(0))
            if sample.kinds == begin.kinds
        ]
        for noise in (0.2, 1.0)
    )
    assert begin.with_noise(0.5).misfit == pytest.approx(4.0 * begin.misfit)
    assert np.std(near, axis=0).mean() < 0.7 * np.std(far, axis=0).mean()


def test_no_regions_in_an_empty_medium() -> None:
    model = ForwardModel(disc(16, 700), Pattern.adjacent(16), 0.01)
    v = model.solve(1.0).voltages
    seen = Observation.of(v, 0.01 * np.abs(v))
    start = ShapeImaging(model, 0.04)(seen, 1.0)
    regions = PlacedRegions(model, seen.whitened(208), prior(), 0.98, 1.0, 0.2, 2.0)
    assert search(regions, start, 1)[0].placement.kinds == ()


# Which labels to give.


def pictures() -> np.ndarray:
    """(12, 64, 64) squares of kind 2 about one place, some of them larger."""
    rng, made = np.random.default_rng(3), np.zeros((12, 64, 64), np.uint8)
    for picture in made:
        row, column = rng.integers(15, 25, 2)
        picture[row : row + rng.integers(10, 20), column : column + 14] = 2
    return made


def test_the_labels_are_better_than_every_sample_and_threshold() -> None:
    windows = SimilarityWindows.of(64, 20.0)

    def mean(mask: np.ndarray) -> float:
        return float(windows.similarity(mask, pictures() == 2).mean())

    best, value = most_similar(pictures(), 20.0)
    assert set(np.unique(best)) == {0, 2}
    assert mean(best == 2) == pytest.approx(value, abs=0.01)
    often = (pictures() == 2).mean(axis=0)
    others = [*(pictures() == 2), *(often > least for least in (0.2, 0.5, 0.8))]
    assert mean(best == 2) > max(mean(mask) for mask in others) - 1e-3


def test_what_is_mostly_absent_is_not_given() -> None:
    rarely, often = pictures(), pictures()
    rarely[:8] = 0
    often[:2] = 0
    assert not most_similar(rarely, 20.0)[0].any()
    assert most_similar(often, 20.0)[0].any()
    assert most_similar(np.zeros((3, 8, 8), np.uint8), 2.0)[1] == 1.0


def test_a_pixel_has_its_likelier_label() -> None:
    both = pictures()
    both[9:][both[9:] == 2] = 1
    best = most_similar(both[[0, 1, 2, 9]], 20.0)[0]
    often = [(both[[0, 1, 2, 9]] == kind).mean(axis=0) for kind in (1, 2)]
    assert (best[often[1] > 0.6] == 2).all()
    assert not (best[often[0] == 0.0] == 1).any()


def test_one_picture_is_its_own_answer() -> None:
    one = pictures()[:1]
    one[0, 50:60, 5:20] = 1
    best, value = most_similar(one, 20.0)
    assert np.array_equal(best, one[0])
    assert value == pytest.approx(1.0)


# Refused.


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"size": 0.0}, "expected a size above 0, got 0.0"),
        ({"expected": 0.0}, "expected a number of regions above 0, got 0.0"),
        ({"drift": np.nan}, "drift above 0, got nan"),
        ({"contrast": 1.0}, "expected a contrast above 1, got 1.0"),
        ({"walk_noise": 0.0}, "expected a noise of the walk above 0, got 0.0"),
        ({"samples": 0}, "expected 1 to 400 samples of 500 steps, got 0"),
        ({"steps": 10}, "expected 1 to 8 samples of 10 steps, got 50"),
    ],
)
def test_impossible_settings(settings: dict[str, Any], message: str) -> None:
    model = ForwardModel(disc(), Pattern.adjacent(8), 0.01)
    with pytest.raises(ModelError, match=message):
        ShapeSampling(model, **{"size": SIZE, **settings})


def test_a_volume_is_refused() -> None:
    bar = box(np.linspace(0, 0.2, 5), np.linspace(0, 0.05, 3), np.linspace(0, 0.05, 3))
    model = ForwardModel(bar, Pattern.from_tables([[0, 1]], [[0, 1]]), 1e-4)
    with pytest.raises(ModelError, match="expected a mesh of triangles, got one of 3 dimensions"):
        ShapeSampling(model, SIZE)


def test_pictures_that_are_not_square() -> None:
    with pytest.raises(DataError, match=r"expected pictures of shape \(k, n, n\), got \(2, 3, 4\)"):
        most_similar(np.zeros((2, 3, 4), np.uint8), 2.0)
