"""A sheet with electrodes to fit touches on, made once, and what a read-out adds to it."""

from __future__ import annotations

from functools import cache

import numpy as np

from shapes import disc
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.fit import Response, Whitener, row_covariance

SAMPLE_SD = 30e-6
"""Of a sample, V: 0.7 LSB of 10 bits at a gain of 35, 16 conversions."""


@cache
def sheet(n: int = 16, cells: int = 900) -> Response:
    """A disc of 0.1 m radius, 0.8 Ω per square, 0.1 A through neighbours."""
    model = ForwardModel(disc(n, cells, width=0.01), Pattern.adjacent(n), 2e-4, 0.1)
    return Response(model.at(1.25))


@cache
def covariance(n: int = 16) -> FloatArray:
    return row_covariance(Scan.of(Pattern.adjacent(n)), SAMPLE_SD)


@cache
def whitener(n: int = 16) -> Whitener:
    return Whitener.of(covariance(n))


def noise(n: int, count: int, seed: int) -> FloatArray:
    """(count, n_meas) V of rows that share samples."""
    scan = Scan.of(Pattern.adjacent(n))
    samples = SAMPLE_SD * np.random.default_rng(seed).standard_normal((count, scan.n_samples))
    return np.asarray(samples[:, scan.plus] - samples[:, scan.minus])
