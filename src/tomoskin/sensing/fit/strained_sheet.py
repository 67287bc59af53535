"""What smooth strains of a whole sheet do to its voltages: exactly, and to first order."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.forward import ForwardModel, State, Terminals
from tomoskin.sensing.fit.spot import Response
from tomoskin.sensing.fit.strain import (
    LOG_WIDTH,
    Strain,
    StrainPrior,
    exponential,
    profile,
)

_AXES, _OFFSETS, _WIDTHS = 18, 15, (0.05, 0.08, 0.125, 0.19)
"""Folds of a table: axes, offsets along each, and widths in parts of the sheet's breadth."""

_PATCHES = 400
"""Patches of the sheet in which strains are even, for derivatives."""


@dataclass(frozen=True, eq=False)
class FoldTable:
    """Folds all over a sheet, and what small ones do.

    Attributes
    ----------
    numbers
        (n, 5) of each fold, its level and deviator zero.
    basis
        (n_meas, k) V, orthogonal.
    level, deviator
        (k, n) what one of each does, in the basis.
    """

    numbers: FloatArray
    basis: FloatArray
    level: FloatArray
    deviator: FloatArray


class StrainedSheet:
    """A sheet with strains all over it.

    Parameters
    ----------
    response
        The sheet that is strained.
    """

    def __init__(self, response: Response) -> None:
        self._state, self._profile = response.state, response.spots.profile
        mesh = self._state.model.mesh
        self.points = mesh.centroids
        self.breadth = math.sqrt(float(mesh.volumes.sum()))
        self.reach = float(np.linalg.norm(mesh.points, axis=1).max())
        self.prior = StrainPrior(self.breadth)

    def warm_up(self) -> None:
        """Do what takes part of a second."""
        _ = self.table, self._at_rest

    def adapted(self, response: Response) -> StrainedSheet:
        """That of a sheet that is a little otherwise: derivatives and the table are these."""
        other = StrainedSheet(response)
        kept = ("_by_patch", "_group", "table")
        vars(other).update({name: vars(self)[name] for name in kept if name in vars(self)})
        return other

    @cached_property
    def _terminals(self) -> Terminals:
        return Terminals(self._state.model)

    @cached_property
    def _at_rest(self) -> FloatArray:
        """(n_meas,) V by the same arithmetic."""
        return self._voltages(np.zeros((len(self.points), 3)))

    def _voltages(self, field: FloatArray) -> FloatArray:
        sigma = self._state.conductivity[:, None, None] * exponential(field)
        return self._state.model.voltages(self._terminals.transfer_resistance(sigma))

    def change(self, strain: Strain) -> FloatArray:
        """(n_meas,) V that a ``strain`` adds to the sheet at rest, exactly."""
        return np.asarray(self._voltages(strain.field(self.points)) - self._at_rest)

    def response(self, strain: Strain) -> Response:
        """The sheet as it is strained, with touches on it: some milliseconds of work.

        Its conductivity is a scalar again: what differs by direction is in the metric of the mesh,
        exp(−D) for L = mean + D, D without a trace.
        """
        model, field = self._state.model, strain.field(self.points)
        mean = (field[:, 0] + field[:, 1]) / 2
        within = exponential(-(field - mean[:, None] * np.array([1.0, 1.0, 0.0])))
        if model.mesh.metric is not None:
            frame = np.linalg.cholesky(model.mesh.metric)
            within = frame @ within @ frame.transpose(0, 2, 1)
        mesh = model.mesh.with_metric(within)
        own = ForwardModel(mesh, model.pattern, model.contact_impedance, model.current)
        return Response(own.at(self._state.conductivity * np.exp(mean)), self._profile)

    def directions(self, strain: Strain, size: float) -> FloatArray:
        """(n_meas, d + k) V: derivatives of the change by the numbers, as about the sheet at rest,
        and what may be otherwise; see :meth:`Strain.otherwise`."""
        middles = self._patches
        otherwise = strain.otherwise(middles, self.breadth, size)
        return self._linear(np.concatenate([strain.slopes(middles), otherwise], axis=2))

    def _linear(self, fields: FloatArray) -> FloatArray:
        """(n_meas, k) V of fields (patches, 3, k)."""
        k = fields.shape[2]
        return np.asarray(self._by_patch @ fields.transpose(1, 0, 2).reshape(-1, k))

    @cached_property
    def _group(self) -> tuple[IntArray, FloatArray]:
        """(n_cells,) patch of each cell, and (p, 2) middles of the patches, m."""
        step = self.breadth / math.sqrt(_PATCHES)
        place = np.floor(self.points / step).astype(int)
        _, group = np.unique(place, axis=0, return_inverse=True)
        group = group.ravel()
        size = np.bincount(group)
        middle = np.stack([np.bincount(group, x) / size for x in self.points.T], axis=1)
        return np.asarray(group, np.int64), middle

    @property
    def _patches(self) -> FloatArray:
        return self._group[1]

    @cached_property
    def _by_cell(self) -> FloatArray:
        """(3, n_meas, n_cells) V: derivatives by xx, yy, xy of L of a cell."""
        return tensor_slopes(self._state)

    @cached_property
    def _by_patch(self) -> FloatArray:
        """(n_meas, 3 p) V: the same of a patch."""
        group, middle = self._group
        onto = np.zeros((len(group), len(middle)))
        onto[np.arange(len(group)), group] = 1.0
        return np.asarray(np.hstack([part @ onto for part in self._by_cell]))

    @cached_property
    def table(self) -> FoldTable:
        """Folds all over the sheet: a tenth of a second of work."""
        numbers = self._grid()
        fields = np.empty((len(self._patches), len(numbers)))
        turned = np.empty((3, len(numbers)))
        for k, own in enumerate(numbers):
            slopes = Strain("fold", own)
            q, _ = slopes._away(self._patches)
            fields[:, k], turned[:, k] = profile(q)[0], slopes._tensors[1]
        xx, yy, xy = (part @ fields for part in np.split(self._by_patch, 3, axis=1))
        level, deviator = xx + yy, turned[0] * xx + turned[1] * yy + turned[2] * xy
        basis = _basis(np.hstack([level, deviator]))
        return FoldTable(numbers, basis, basis.T @ level, basis.T @ deviator)

    def _grid(self) -> FloatArray:
        """(n, 5) of folds."""
        axes = np.arange(_AXES) * math.pi / _AXES
        out = []
        for axis in axes:
            across = self.points @ np.array([math.sin(axis), -math.cos(axis)])
            for offset in np.linspace(across.min(), across.max(), _OFFSETS + 2)[1:-1]:
                out += [[axis, offset, math.log(width * self.breadth), 0, 0] for width in _WIDTHS]
        numbers = np.array(out)
        assert numbers.shape[1] > LOG_WIDTH
        return numbers


_CLEAR = 1e-4
"""Part of the largest singular value below which a direction of a table does not count."""


def _basis(columns: FloatArray) -> FloatArray:
    """(n_meas, k) orthonormal, in which ``columns`` (n_meas, n) lie."""
    size, vectors = np.linalg.eigh(columns @ columns.T)
    return np.asarray(vectors[:, size > _CLEAR**2 * size[-1]])


def tensor_slopes(state: State) -> FloatArray:
    """(3, n_meas, n_cells) V: derivatives of the voltages by xx, yy, xy of each cell's L, where
    the conductivity is σ exp(L)."""
    sigma = state.conductivity
    tensor = state.model.at(sigma[:, None, None] * np.eye(2)).jacobian
    return np.asarray(
        sigma * np.stack([tensor[..., 0, 0], tensor[..., 1, 1], 2.0 * tensor[..., 0, 1]])
    )
