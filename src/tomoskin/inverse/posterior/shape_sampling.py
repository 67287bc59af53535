"""Samples of the regions that explain what was measured, and what they agree on."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, ModelError
from tomoskin.forward import ForwardModel
from tomoskin.inverse.iterative.observation import Observation, Whitened
from tomoskin.inverse.iterative.shapes import CONTRAST, LESS, MORE, Segmented
from tomoskin.inverse.posterior.placement import PlacedRegions, Placement
from tomoskin.inverse.posterior.sampling import walk
from tomoskin.inverse.posterior.search import Alternative, search
from tomoskin.inverse.posterior.stars import StarPrior

STEPS, SAMPLES, ROUNDS = 500, 50, 2
"""Steps of the walk, placements that are kept, and rounds of the search before it."""

_BURN = 0.2
"""First part of the walk, which is not kept."""

_FAINT = 0.3
"""Combinations of the data that change by less than this part of their noise when the usual
region appears are left out."""


@dataclass(frozen=True, eq=False)
class ShapePosterior:
    """Regions that explain what was measured, one placement for each sample.

    Attributes
    ----------
    likeliest
        The placement with the greatest evidence.
    samples
        Placements of equal weight: from a walk that begins there, and from walks that begin at
        others with fewer, more or other regions, as many as their evidence says.
    shortfall
        Misfit of ``likeliest`` less that of the segmented image, which may have any shape: far
        above zero where the regions are not star-shaped, and the samples no guide.
    """

    likeliest: Placement
    samples: tuple[Placement, ...]
    shortfall: float

    def at(self, points: FloatArray) -> NDArray[np.uint8]:
        """(n_samples, n) BACKGROUND, LESS or MORE at ``points`` (n, 2) m."""
        return np.stack([labels(sample, points) for sample in self.samples])

    def probability(self, points: FloatArray) -> FloatArray:
        """(n, 3) of background, less and more at ``points`` (n, 2) m."""
        at = self.at(points)
        return np.stack([(at == kind).mean(axis=0) for kind in (0, LESS, MORE)], axis=1)

    def entropy(self, points: FloatArray) -> FloatArray:
        """(n,) bits at ``points`` (n, 2) m: 0 where the data tell the label, at most log₂ 3."""
        p = self.probability(points)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(-np.where(p > 0, p * np.log2(p), 0.0).sum(axis=1))


def labels(placement: Placement, points: FloatArray) -> NDArray[np.uint8]:
    """(n,) BACKGROUND, LESS or MORE at ``points`` (n, 2) m; where two meet, the deeper one."""
    if not placement.kinds:
        return np.zeros(len(points), np.uint8)
    level = placement.among.prior.level(placement.stars, points)
    kinds = np.array(placement.kinds, np.uint8)[level.argmax(axis=0)]
    return np.where(level.max(axis=0) > 0, kinds, 0).astype(np.uint8)


class ShapeSampling:
    """Samples regions that conduct far less or far more than the medium, given the data.

    The image is a few star-shaped regions (:class:`StarPrior`). A search finds the likeliest from
    a segmented image, and a random walk through the complete forward model what else explains
    the data as well: other outlines, and regions where the data would not show them.

    Parameters
    ----------
    model
        The forward model, of triangles.
    size
        Usual radius of a region, m.
    expected
        How many regions there are, the mean of a Poisson law.
    contrast
        Ratio of the conductivities of regions and medium.
    drift
        Deviation expected of the logarithm of the medium's conductivity.
    steps, samples, rounds
        Of the walk and the search; a step costs one forward solution.
    walk_noise
        Noise in the walk over that in the search: below one where the noise was widened for
        errors of the model, which make a search choose too many regions.

    Raises
    ------
    ModelError
        For a number that is impossible, or a mesh of tetrahedra.
    """

    def __init__(
        self,
        model: ForwardModel,
        size: float,
        *,
        expected: float = 2.0,
        contrast: float = CONTRAST,
        drift: float = 0.2,
        steps: int = STEPS,
        samples: int = SAMPLES,
        rounds: int = ROUNDS,
        walk_noise: float = 1.0,
    ) -> None:
        if not (np.isfinite(contrast) and contrast > 1):
            raise ModelError(f"expected a contrast above 1, got {contrast}")
        numbers = {"number of regions": expected, "drift": drift, "noise of the walk": walk_noise}
        for name, value in numbers.items():
            if not (np.isfinite(value) and value > 0):
                raise ModelError(f"expected a {name} above 0, got {value}")
        most = int((1.0 - _BURN) * steps)
        if not 0 < samples <= most:
            raise ModelError(f"expected 1 to {most} samples of {steps} steps, got {samples}")
        self.model = model
        self.prior = StarPrior.on(model.mesh, size)
        self.expected = expected
        self.reflection = (contrast - 1.0) / (contrast + 1.0)
        self.drift = drift
        self.steps, self.samples, self.rounds = steps, samples, rounds
        self.walk_noise = walk_noise

    def __call__(
        self,
        observation: Observation,
        start: Segmented,
        background: float | None = None,
        *,
        seed: int = 0,
    ) -> ShapePosterior:
        """Regions that explain ``observation``, from the regions of ``start`` on.

        ``background`` is what the medium is expected to have, S; without it, what ``start`` has.
        Raises DataError when the observation is not one of this pattern.
        """
        data = observation.whitened(self.model.pattern.n_meas)
        medium = start.found.background if background is None else background
        regions = PlacedRegions(
            self.model,
            informative(data, self.model, start, medium),
            self.prior,
            self.reflection,
            medium,
            self.drift,
            self.expected,
        )
        alternatives = search(regions, start, self.rounds)
        likeliest, rng = alternatives[0].placement, np.random.default_rng(seed)
        samples = [sample for one in alternatives for sample in self._walked(one, rng)]
        shortfall = likeliest.misfit - regions.misfit(start.found.conductivity.values)
        return ShapePosterior(likeliest, tuple(samples), shortfall)

    def _walked(self, begin: Alternative, rng: np.random.Generator) -> list[Placement]:
        """Its share of the samples, from its share of the steps."""
        steps, samples = (int(np.ceil(begin.weight * n)) for n in (self.steps, self.samples))
        walked = list(walk(begin.placement.with_noise(self.walk_noise), steps, rng))
        kept = np.linspace(_BURN * steps, steps - 1, samples).astype(int)
        return [walked[k] for k in kept]


def informative(
    data: Whitened, model: ForwardModel, start: Segmented, background: float
) -> Whitened:
    """The combinations of ``data`` that regions can change by more than a part of their noise.

    Judged on the medium alone, by the covariance of the field of ``start``.
    """
    jacobian = data.rows @ (model.at(background).jacobian * background)
    left, size, _ = np.linalg.svd(jacobian @ start.field.basis, full_matrices=False)
    kept = left[:, size > _FAINT].T
    return replace(data, target=kept @ data.target, rows=kept @ data.rows)
