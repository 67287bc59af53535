"""Admittivity of a few regions, and the Cole model of its dispersion over frequency."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import least_squares

from tomoskin.core import ComplexArray, DataError, FloatArray, IntArray, ModelError
from tomoskin.imaging.frequency_difference import check_frequencies
from tomoskin.model.forward import ForwardModel

_STEPS = 50
_DONE = 1e-9
_HALVINGS = 20

_WIDEST = 10.0
"""A region that leaves the even start by this power of e is on its way to zero or infinity."""

LEAST = 3
"""Frequencies, each of two numbers, that four parameters with an error need."""

_MOST_ALPHA = 0.99

_DECADES = 3.0
"""The relaxation may lie so far beyond the measured frequencies."""

_UNDETERMINED = 1e-12
"""Directions of the parameters that move the data less than this are not determined."""


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
        Root of the mean square of the residual voltages, V.
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
            "no admittivities fit the voltages: the iteration does not converge",
            hint="start nearer to the solution, use fewer regions, or check the model",
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
        raise DataError(
            f"expected finite voltages, but rows {np.flatnonzero(~np.isfinite(data))} are not "
            "finite"
        )
    if n_regions > n:
        raise DataError(f"{n} voltages are too few to estimate {n_regions} regions")
    return data


@dataclass(frozen=True, eq=False)
class Cole:
    """σ*(ω) = σ∞ + (σ₀ − σ∞) / (1 + (jωτ)^(1−α)) (Cole 1940, for admittivity).

    Attributes
    ----------
    low, high
        σ₀ and σ∞, S or S/m: far below and far above the relaxation.
    time_constant
        τ, s.
    alpha
        α, from 0 (a single relaxation) towards 1 (spread out).
    covariance
        (4, 4) of low, high, time constant and alpha; infinite where the data do not determine it.
    misfit
        Root mean square of the residuals, S or S/m.
    """

    low: float
    high: float
    time_constant: float
    alpha: float
    covariance: FloatArray
    misfit: float

    @property
    def sd(self) -> FloatArray:
        """(4,) standard deviations, in the order of ``covariance``."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def __call__(self, frequency: ArrayLike) -> ComplexArray:
        """Admittivity at frequencies in Hz, of their shape."""
        parameters = (self.low, self.high, self.time_constant, self.alpha)
        return cole(np.asarray(frequency, dtype=np.float64), *parameters)

    @classmethod
    def fit(cls, frequency: ArrayLike, admittivity: ArrayLike, sd: ArrayLike | None = None) -> Cole:
        """Least squares within bounds, from several starts.

        Parameters
        ----------
        frequency
            (n,) Hz, n ≥ 3, each once.
        admittivity
            (n,) σ + jωε, S or S/m.
        sd
            (n,) standard deviation of its real and of its imaginary part. Without it, all are
            equal and their size is taken from the misfit.

        Raises
        ------
        DataError
            For fewer than three frequencies, one that is not above 0 or stands twice, values
            that are not finite or without conductivity, or an sd that is not above 0.
        """
        f, gamma = _checked(frequency, admittivity)
        weight = _weight(sd, gamma)
        best = min(_fits(f, gamma, weight), key=lambda fit: float(fit.cost))
        free = 2 * len(f) - 4
        scale = 1.0 if sd is not None else 2.0 * float(best.cost) / free
        sigma0, sigma1, tau = (float(value) for value in np.exp(best.x[:3]))
        alpha = float(best.x[3])
        by_natural = np.array([sigma0, sigma1, tau, 1.0])
        covariance = _inverse(np.asarray(best.jac)) * np.outer(by_natural, by_natural)
        residual = cole(f, sigma0, sigma1, tau, alpha) - gamma
        misfit = float(np.sqrt((np.abs(residual) ** 2).mean()))
        return cls(sigma0, sigma1, tau, alpha, scale * covariance, misfit)


def cole(
    frequency: FloatArray, low: float, high: float, time_constant: float, alpha: float
) -> ComplexArray:
    """The formula of :class:`Cole`."""
    relaxation = (2j * np.pi * frequency * time_constant) ** (1.0 - alpha)
    return np.asarray(high + (low - high) / (1.0 + relaxation))


def cole_of_regions(
    models: Mapping[float, ForwardModel],
    voltages: Mapping[float, NDArray[Any]],
    labels: ArrayLike,
    start: complex = 1.0,
) -> tuple[Cole, ...]:
    """The dispersion of each region of a mesh, from voltages at several frequencies.

    At each frequency :meth:`Regions.fit` finds the admittivities; their deviations weigh the
    fit of :meth:`Cole.fit`. For the parameters see there.

    Raises
    ------
    DataError, ModelError
        As these do, or when a frequency has no voltages.
    """
    check_frequencies(models)
    missing = [f for f in models if f not in voltages]
    if missing:
        raise DataError(f"expected voltages at {missing[0]:g} Hz, got none")
    if len(models) < LEAST:
        raise _too_few(len(models))
    fits = [Regions.fit(model, voltages[f], labels, start) for f, model in models.items()]
    values = np.stack([fit.values for fit in fits])
    # what a complex value may be off by is shared by its two parts
    sd = np.sqrt(np.stack([np.diag(fit.covariance).real for fit in fits]) / 2.0)
    weighted = np.asarray((sd > 0).all(axis=0))
    return tuple(
        Cole.fit(list(models), values[:, r], sd[:, r] if weighted[r] else None)
        for r in range(values.shape[1])
    )


def _residual(
    parameters: FloatArray, frequency: FloatArray, gamma: ComplexArray, weight: FloatArray
) -> FloatArray:
    low, high, time_constant = np.exp(parameters[:3])
    residual = weight * (cole(frequency, low, high, time_constant, parameters[3]) - gamma)
    return np.concatenate([residual.real, residual.imag])


def _fits(frequency: FloatArray, gamma: ComplexArray, weight: FloatArray) -> Iterator[Any]:
    """Minima from relaxations at the ends and in the middle, sharp and spread out."""
    ends = gamma.real[[frequency.argmin(), frequency.argmax()]]
    low, high = np.log(np.maximum(ends, 1e-3 * np.abs(gamma).max()))
    slow, fast = frequency.min(), frequency.max()
    for middle, spread in product((slow, np.sqrt(slow * fast), fast), (0.0, 0.3)):
        yield least_squares(
            _residual,
            [low, high, -np.log(2 * np.pi * middle), spread],
            bounds=_bounds(frequency, gamma),
            args=(frequency, gamma, weight),
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
        )


def _bounds(frequency: FloatArray, gamma: ComplexArray) -> tuple[list[float], list[float]]:
    size, wide = float(np.log(np.abs(gamma).max())), float(_DECADES * np.log(10.0))
    slow, fast = -np.log(2 * np.pi * np.array([frequency.min(), frequency.max()]))
    lower = [size - 4 * wide, size - 4 * wide, float(fast) - wide, 0.0]
    return lower, [size + wide, size + wide, float(slow) + wide, _MOST_ALPHA]


def _inverse(jacobian: FloatArray) -> FloatArray:
    """(JᵀJ)⁻¹; infinite where the data do not determine it."""
    _, size, axes = np.linalg.svd(jacobian, full_matrices=False)
    determined = size > np.sqrt(_UNDETERMINED) * size.max()
    covariance = (axes[determined].T / size[determined] ** 2) @ axes[determined]
    free = (np.abs(axes[~determined]) > 1e-6).any(axis=0)
    covariance[free] = covariance[:, free] = np.inf
    return np.asarray(covariance)


def _weight(sd: ArrayLike | None, gamma: ComplexArray) -> FloatArray:
    if sd is None:
        return np.full(len(gamma), 1.0)
    deviation = np.asarray(sd, dtype=np.float64)
    if deviation.shape != gamma.shape:
        raise DataError(f"expected {len(gamma)} deviations, got shape {deviation.shape}")
    if not (np.isfinite(deviation) & (deviation > 0)).all():
        raise DataError(f"expected deviations above 0, got {deviation.min():g}")
    return np.asarray(1.0 / deviation)


def _checked(frequency: ArrayLike, admittivity: ArrayLike) -> tuple[FloatArray, ComplexArray]:
    f = np.asarray(frequency, dtype=np.float64)
    gamma = np.asarray(admittivity, dtype=np.complex128)
    if f.ndim != 1 or f.shape != gamma.shape:
        raise DataError(f"expected as many frequencies as values, got {f.shape} and {gamma.shape}")
    if len(f) < LEAST:
        raise _too_few(len(f))
    if not (np.isfinite(f) & (f > 0)).all():
        raise DataError(f"expected frequencies above 0 Hz, got {f.min():g} Hz")
    if len(np.unique(f)) < len(f):
        raise DataError("expected each frequency once, got some of them twice")
    if not np.isfinite(gamma).all() or not (gamma.real > 0).all():
        raise DataError(
            f"expected finite admittivities with a conductivity above 0, got {gamma.tolist()}"
        )
    return f, gamma


def _too_few(count: int) -> DataError:
    return DataError(
        f"expected at least {LEAST} frequencies for the four parameters of a Cole model, "
        f"got {count}",
        hint="measure at more frequencies, spread over the dispersion",
    )
