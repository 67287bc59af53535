"""Labels of a tank whose score is the best expected over sampled regions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.inverse import Observation, ShapeImaging, ShapeSampling, most_similar

SIZE = 0.026
"""Usual radius of a target, m."""

CLOSER, IN_WALK = 0.5, 0.25
"""Noise of the sampled regions over that of the example, and in the walk over that again."""

MOST_SHORT = 3.5
"""Misfit by which they may fall short of regions of any shape; beyond, those are given.

All three were chosen on simulated tanks, seeds 3000 to 3008, levels 1, 5 and 7."""


def sampled(example: Any, tank: Any, level: int) -> NDArray[np.uint8]:
    """Labels (256, 256) of one sample at one level; ``example`` is the module ktc2023."""
    keep = example.kept(tank.inj, tank.mpat, level)
    readout, u, u_ref = example.checked(tank.u, tank.u_ref, tank.inj, tank.mpat, keep)
    water, sigma, seen = example.observed(readout, u, u_ref)
    start = ShapeImaging(water, example.LENGTH, drift=example.DRIFT)(seen, sigma)
    sampling = ShapeSampling(water, SIZE, drift=example.DRIFT, walk_noise=IN_WALK)
    closer = Observation.of(seen.values, CLOSER * seen.noise, seen.combine)
    posterior = sampling(closer, start, sigma)
    short = posterior.shortfall > MOST_SHORT
    points, inside = example.pixels(example.PIXELS if short else example.PIXELS // 2)
    labels = np.zeros((1 if short else len(posterior.samples), *inside.shape), np.uint8)
    labels[:, inside] = start.at(points) if short else posterior.at(points)
    best, _ = most_similar(labels, example.SIMILAR * len(inside) / example.PIXELS)
    times = example.PIXELS // len(best)
    return np.asarray(example.without_specks(best.repeat(times, 0).repeat(times, 1)))
