"""Admittivity of a few regions, from the voltages of one frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import ComplexArray, DataError, IntArray, ModelError
from tomoskin.forward import ForwardModel

_STEPS = 50
_DONE = 1e-9
_HALVINGS = 20

_WIDEST = 10.0
"""A region that leaves the even start by this power of e is on its way to zero or infinity."""


@dataclass(frozen=True, eq=False)
class Regions:
    """What fits the voltages best.

    Attributes
    ----------
    values
        (n_regions,) σ or σ + jωε, S or S/m.
    covariance
        (n_regions, n_regions) of ``values``, Hermitian; from the misfit, which includes what is
        wrong with the model.
    misfit
        Root of the mean square of what is left of the voltages, V.
    """

    values: NDArray[Any]
    covariance: ComplexArray
    misfit: float

    @classmethod
    def fit(
        cls, model: ForwardModel, voltages: NDArray[Any], labels: ArrayLike, start: complex = 1.0
    ) -> Regions:
        """Fit one admittivity per region by Gauss–Newton with halved steps.

        Voltages are analytic in the admittivity, so that complex data need no more than real
        ones.

        Parameters
        ----------
        labels
            (n_cells,) region of each cell, 0 to n_regions − 1.
        start
            Any admittivity of about the right size and phase.

        Raises
        ------
        DataError
            When voltages or labels do not fit the model, a region has no cell, or there are
            fewer voltages than regions.
        ModelError
            When it does not converge, or a region runs to zero or infinity.
        """
        region = _labels(labels, model)
        data = _data(voltages, model, int(region.max()) + 1)
        gamma = first = _first(model, data, region, start)
        for _ in range(_STEPS):
            state = model.at(gamma[region])
            jacobian = _by_region(state.jacobian, region)
            residual = data - state.voltages
            step = np.linalg.lstsq(jacobian, residual, rcond=None)[0]
            gamma = _stepped(model, data, region, gamma, step)
            if np.abs(np.log(np.abs(gamma / first))).max() > _WIDEST:
                break
            if np.abs(step).max() < _DONE * np.abs(gamma).max():
                return cls(gamma, *_spread(jacobian, residual))
        raise ModelError(
            "no admittivities fit the voltages: the steps do not settle",
            hint="start nearer, take fewer regions, or check the model",
        )


def _by_region(jacobian: NDArray[Any], region: IntArray) -> NDArray[Any]:
    """(n_meas, n_regions): columns of cells summed."""
    columns = [jacobian[:, region == r].sum(axis=1) for r in range(int(region.max()) + 1)]
    return np.stack(columns, axis=1)


def _first(
    model: ForwardModel, data: NDArray[Any], region: IntArray, start: complex
) -> NDArray[Any]:
    """The same everywhere: voltages go with the inverse of an even admittivity."""
    there = model.at(start).voltages
    ratio = np.vdot(there, data) / np.vdot(there, there)
    even = start / ratio if ratio and np.real(start / ratio) > 0 else start
    return np.full(int(region.max()) + 1, even)


def _stepped(
    model: ForwardModel,
    data: NDArray[Any],
    region: IntArray,
    gamma: NDArray[Any],
    step: NDArray[Any],
) -> NDArray[Any]:
    """The step, halved until conductivities change no more than tenfold and the misfit falls."""
    before = np.linalg.norm(data - model.at(gamma[region]).voltages)
    for halving in range(_HALVINGS):
        tried = gamma + 0.5**halving * step
        if (tried.real > 0.1 * gamma.real).all() and (np.abs(tried) < 10.0 * np.abs(gamma)).all():
            after = np.linalg.norm(data - model.at(tried[region]).voltages)
            if after <= before * (1 + _DONE):
                return tried
    return gamma


def _spread(jacobian: NDArray[Any], residual: NDArray[Any]) -> tuple[ComplexArray, float]:
    rows, regions = jacobian.shape
    power = float(np.vdot(residual, residual).real)
    inverse = np.linalg.pinv(jacobian.conj().T @ jacobian, hermitian=True)
    covariance = power / max(rows - regions, 1) * inverse
    return covariance.astype(np.complex128), float(np.sqrt(power / rows))


def _labels(labels: ArrayLike, model: ForwardModel) -> IntArray:
    region = np.asarray(labels)
    n = len(model.mesh.cells)
    if region.shape != (n,) or region.dtype.kind not in "iu":
        raise DataError(
            f"expected a whole number for each of {n} cells, got {region.shape} {region.dtype}",
            where="labels",
        )
    if region.min() < 0:
        raise DataError(f"expected regions from 0, got {region.min()}", where="labels")
    empty = np.flatnonzero(np.bincount(region) == 0)
    if len(empty):
        raise DataError(f"region {empty[0]} has no cell", where="labels")
    return np.asarray(region, dtype=np.int64)


def _data(voltages: NDArray[Any], model: ForwardModel, n_regions: int) -> NDArray[Any]:
    data = np.asarray(voltages)
    n = model.pattern.n_meas
    if data.shape != (n,):
        raise DataError(f"expected voltages of shape ({n},), got {data.shape}")
    if not np.isfinite(data).all():
        raise DataError(f"expected finite voltages; rows {np.flatnonzero(~np.isfinite(data))}")
    if n_regions > n:
        raise DataError(f"{n} voltages cannot tell {n_regions} regions")
    return data
