"""Which regions there are: split, drop and add them while that is more probable."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from tomoskin.core import FloatArray, ModelError
from tomoskin.inverse.iterative.shapes import LESS, MORE, Segmented
from tomoskin.inverse.posterior.placement import PlacedRegions, Placement

_STEPS = 4
"""Gauss–Newton steps for a placement."""

_TRIED = {"drop": 1, "split": 2, "add": 3}
"""The best so many changes of each kind are fitted in a round."""

_BEHIND = 30.0
"""A change whose objective is still so far above the best one's after two steps is given up."""

_APART = 1.3
"""Distance of the places where a region may be added, over the usual radius."""

_SMALL = 0.45
"""Radius of a region that is added, over the usual one."""

_LEAST, _DIFFERENT = 0.03, 0.4
"""Evidence of an alternative over the best one's, and the part of a region by which it differs."""

_SMALLEST = 0.05
"""Area of a segmented region that is taken up, over that of a usual one."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """A placement, and how probable regions like it are among all that were found."""

    placement: Placement
    weight: float


def search(regions: PlacedRegions, start: Segmented, rounds: int) -> tuple[Alternative, ...]:
    """The most probable placements that are found from the regions of ``start``, best first.

    Each round fits the best changes, ranked by one forward solution each, and takes the one with
    the greatest evidence, while there is one. What the last round tried are the alternatives.
    """
    best = regions.fitted(of_segments(regions, start), 2 * _STEPS)
    tried = [best]
    for _ in range(rounds):
        changes = [_tried(change, best) for change in _best_changes(best)]
        tried = [best, *(change for change in changes if change is not None)]
        better = max(tried, key=lambda placement: placement.evidence)
        if better is best:
            break
        best = better
    return _alternatives(tried)


def _alternatives(tried: Sequence[Placement]) -> tuple[Alternative, ...]:
    """Those that differ and are not far less probable than the best, weighted by evidence."""
    kept: list[Placement] = []
    for placement in sorted(tried, key=lambda placement: -placement.evidence):
        if not any(_same(placement, other) for other in kept):
            kept.append(placement)
    weights = np.exp([placement.evidence - kept[0].evidence for placement in kept])
    kept = [p for p, weight in zip(kept, weights, strict=True) if weight > _LEAST]
    weights = weights[weights > _LEAST] / weights[weights > _LEAST].sum()
    return tuple(Alternative(p, float(w)) for p, w in zip(kept, weights, strict=True))


def _same(one: Placement, other: Placement) -> bool:
    """Whether they differ in less than a part of a usual region."""
    of = one.among
    differs = np.abs(one.point.conductivity - other.point.conductivity) > 0.5 * of.background
    area = float(of.model.mesh.volumes @ differs)
    return area < _DIFFERENT * np.pi * of.prior.size**2


def of_segments(regions: PlacedRegions, start: Segmented) -> Placement:
    """A region for each connected segment of ``start``, with its area and its ellipse."""
    mesh, labels = regions.model.mesh, start.cells
    first, second = mesh.neighbours[
        (labels[mesh.neighbours] == labels[mesh.neighbours][:, :1]).all(axis=1)
    ].T
    alike = csr_array((np.ones(len(first)), (first, second)), (len(labels), len(labels)))
    count, piece = connected_components(alike, directed=False)
    area = np.bincount(piece, mesh.volumes, count)
    log_background = np.log(start.found.background / regions.background)
    placement = regions.place((), np.array([log_background]))
    for k in np.flatnonzero(area > _SMALLEST * np.pi * regions.prior.size**2):
        cells = piece == k
        if kind := int(labels[cells][0]):
            star = _ellipse(regions, mesh.centroids[cells], mesh.volumes[cells])
            placement = placement.with_star(kind, star)
    return placement


def _ellipse(regions: PlacedRegions, points: FloatArray, areas: FloatArray) -> FloatArray:
    """Latent numbers of the ellipse with the centre, area and second moments of cells."""
    share = areas / areas.sum()
    centre = share @ points
    away = (points - centre) @ np.array([1.0, 1j])
    # an outline exp(b cos 2θ) of small b has this ratio 2b
    wave = complex(share @ away**2 / (share @ np.abs(away) ** 2)) / 2.0
    return regions.prior.ellipse(centre, float(np.sqrt(areas.sum() / np.pi)), wave)


def _tried(change: Placement, best: Placement) -> Placement | None:
    """Fitted, unless two steps show that it stays behind ``best``."""
    regions = best.among
    try:
        near = regions.fitted(change, 2)
        if near.objective > best.objective + _BEHIND:
            return None
        return regions.fitted(near, _STEPS)
    except ModelError:  # no model has such a conductivity
        return None


def _best_changes(placement: Placement) -> list[Placement]:
    makers = {"drop": _dropped, "split": _split, "add": _added}
    ranked = []
    for name, most in _TRIED.items():
        changes = sorted(makers[name](placement), key=lambda change: change.objective)
        ranked += changes[:most]
    return ranked


def _dropped(placement: Placement) -> Iterator[Placement]:
    """One region less."""
    for i in range(len(placement.kinds)):
        yield placement.without(i)


def _split(placement: Placement) -> Iterator[Placement]:
    """Two discs instead of one region, along four directions."""
    prior = placement.among.prior
    for i, kind in enumerate(placement.kinds):
        centre = prior.centres(placement.stars)[i]
        radius = float(prior.radii(placement.stars)[i])
        for angle in np.arange(4) * np.pi / 4:
            away = 0.55 * radius * np.array([np.cos(angle), np.sin(angle)])
            split = placement.without(i)
            for sign in (-1.0, 1.0):
                split = split.with_star(kind, prior.ellipse(centre + sign * away, 0.7 * radius))
            yield split


def _added(placement: Placement) -> Iterator[Placement]:
    """One small disc more, anywhere in the medium where no region is."""
    prior, mesh = placement.among.prior, placement.among.model.mesh
    level = prior.level(placement.stars, mesh.centroids)
    taken = np.asarray((level > -0.2).any(axis=0))
    for place in _spread_out(mesh.centroids[~taken], _APART * prior.size):
        for kind in (LESS, MORE):
            yield placement.with_star(kind, prior.ellipse(place, _SMALL * prior.size))


def _spread_out(points: FloatArray, apart: float) -> Iterator[FloatArray]:
    """Of ``points``, those that are farthest from each other, down to ``apart`` m."""
    if not len(points):
        return
    gap = np.linalg.norm(points - points.mean(axis=0), axis=1)
    while gap.max() > apart:
        place = points[int(gap.argmax())]
        yield place
        gap = np.minimum(gap, np.linalg.norm(points - place, axis=1))
