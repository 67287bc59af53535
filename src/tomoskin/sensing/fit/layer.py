"""How thick the soft layer under a sheet is, by the presses that it carries along."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tomoskin.core import DataError, FloatArray
from tomoskin.model.forward import State
from tomoskin.sensing.fit.noise import Whitener
from tomoskin.sensing.fit.spot import LOG_RADIUS, Profile, Response
from tomoskin.sensing.fit.spot_fit import SpotPrior

LAYERS = np.geomspace(1e-3, 64e-3, 13)
"""Thicknesses that are tried, m."""

_FINE = np.geomspace(LAYERS[0], LAYERS[-1], 601)
_THINNER = 0.7e-3
"""M by which tips of 8 to 15 mm on the twin's knit make a layer look thinner: seeds 7301, 7302."""

_FEWEST, _LIKELIER = 5, 3.0
"""Presses that a layer is found from; logarithm of how much likelier it must make them."""

_STEPS, _WIDER, _MOVED = 6, 0.5, 0.02
"""Steps of a fit, and the most that one changes of a radius's logarithm, and of a place, m."""


class LayerEstimate(NamedTuple):
    """Thickness of a layer, m, and the ends of the interval that it lies in with 90 %."""

    value: float
    low: float
    high: float


def estimate_layer(
    state: State,
    noise: Whitener,
    dv: FloatArray,
    spots: FloatArray,
    advance: Callable[[float, float], None] = lambda _done, _of: None,
) -> LayerEstimate:
    """The layer under the untouched sheet of ``state`` that makes presses likeliest.

    Each press has a change of ``dv`` (n, n_meas) V, and lies about where ``spots`` (n, 4) are.
    Every thickness from 1.7 to 65 mm is held for equally likely in its logarithm. Place, size,
    strength, direction and shape of the presses are integrated out by Laplace's method. Where
    presses scatter about their fits more than ``noise`` does, they count less.

    Raises
    ------
    DataError
        For too few presses, or such as are as likely on no soft layer.
    """
    if len(dv) < _FEWEST:
        raise DataError(f"expected at least {_FEWEST} presses with one touch, got {len(dv)}")
    tried, data = [None, *map(float, LAYERS[::-1])], noise(dv)
    logs = np.empty((len(tried), len(dv), 2))
    for row, layer in enumerate(tried):
        advance(row, len(tried))
        response, prior = Response(state, Profile.on(layer)), SpotPrior.of(state.model.mesh, layer)
        fits = [_fitted(response, prior, noise, *each) for each in zip(data, spots, strict=True)]
        logs[row], spots = [fit[:2] for fit in fits], np.array([fit[2] for fit in fits])
    evidence, misfit = logs.sum(axis=1).T
    evidence /= max(1.0, misfit.min() / len(dv) / len(noise.matrix))
    if evidence[1:].max() < evidence[0] + _LIKELIER:
        raise DataError(
            "these presses are as likely on no soft layer",
            hint="press harder, or more often, all over the skin",
        )
    log = np.interp(np.log(_FINE), np.log(LAYERS), evidence[:0:-1])
    part = np.cumsum(np.exp(log - log.max()))
    low, value, high = np.interp((0.05, 0.5, 0.95), part / part[-1], _FINE) + _THINNER
    return LayerEstimate(float(value), float(low), float(high))


def _fitted(
    response: Response, prior: SpotPrior, noise: Whitener, data: FloatArray, spot: FloatArray
) -> tuple[float, float, FloatArray]:
    """Logarithm of the evidence of one press, whose whitened change is ``data``; its misfit; and
    its spot, from one about there."""
    middle, weights = np.array([*spot[:2], *prior.middle[2:]]), prior.weights
    deviations = np.array([[prior.directed], [prior.reshaped]])
    spot, best = prior.held(spot[None], "both")[0], (math.inf, 0.0, 0.0, spot)
    for _ in range(_STEPS):
        change, slopes, nuisances = response.expanded(spot[None])
        unknown = noise(nuisances.T) * deviations
        size = np.eye(len(unknown)) + unknown @ unknown.T
        inverse = np.eye(len(data)) - unknown.T @ np.linalg.solve(size, unknown)
        residual, slopes, held = data - noise(change), noise(slopes.T), weights * (spot - middle)
        normal = slopes @ inverse @ slopes.T + np.diag(weights**2)
        misfit = float(residual @ inverse @ residual)
        cost = (misfit + held @ held) / 2
        volume = np.linalg.slogdet(size)[1] + np.linalg.slogdet(normal)[1]
        log = float(np.log(weights[LOG_RADIUS:]).sum() - cost - volume / 2)
        best = min(best, (cost, log, misfit, spot), key=lambda one: one[0])
        step = np.linalg.solve(normal, slopes @ inverse @ residual - weights * held)
        most = max(abs(step[LOG_RADIUS]) / _WIDER, math.hypot(*step[:2]) / _MOVED, 1.0)
        spot = prior.held((spot + step / most)[None], "both")[0]
    return best[1:]
