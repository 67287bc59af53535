"""The local update: a touch changes few cells, and few nodes lie on them.

Nodes inside the touched patch, and on no electrode, see the rest of the sheet through its rim
only. They are eliminated (Schur complement), from the cells as they were and as they are; the
difference A is the change of the system as the rim sees it. With the inverse of the base system
between the rim's nodes in hand, the voltages of the changed sheet follow exactly from a small
dense system (Woodbury 1950):

    R' = R − Uᵀ (I + A C)⁻¹ A U,

where C = (K⁻¹) between them and U the basis fields on them. A constant changes nothing, so all
three are taken against the first node: what the nodes have in common would cost digits, and does
not enter. How many digits remain shows in the residual, and in the current that a constant drives
through A, which should be none. The engine of scipy eliminates nothing and takes all nodes of the
patch, which is the same formula.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import IntArray, ModelError
from tomoskin.model.forward.arguments import Touch, Touches
from tomoskin.model.forward.engine import BaseState, Patches, singular
from tomoskin.model.forward.solution import Solution, centred, checked_voltages

MOST_BYTES = 1 << 30
"""Columns of the inverse are kept up to this size, then they go."""

MOST_CELLS = 4000
"""A larger patch is no local change: the changed sheet is factorised."""


class LocalUpdate:
    """Exact transfer resistance and voltages of a state with some cells changed.

    Columns of the inverse are computed as nodes are first needed, and kept: the first touch at
    a position costs a solve with as many right-hand sides as its rim has nodes, later ones do not.

    Parameters
    ----------
    base
        The state that changes.
    """

    def __init__(self, base: Solution) -> None:
        self._base, self._model, self._conductivity = base, base.model, base.conductivity
        self._stored = np.zeros(base.model.assembly.n_points, dtype=bool)

    def voltages(self, cells: ArrayLike, conductivity: ArrayLike) -> NDArray[Any]:
        """(n_meas,) V with ``cells`` (n,) changed to ``conductivity`` (n,), as
        :meth:`voltages_of` has those of many touches."""
        return np.asarray(self.voltages_of([(cells, conductivity)])[0])

    def transfer_resistances_of(self, touches: Sequence[Touch]) -> NDArray[Any]:
        """(n_touches, n_electrodes, n_electrodes) Ω of touches, each alone: ``cells`` (n,) changed
        to a conductivity (n,).

        Raises
        ------
        ModelError
            For cells that do not exist or stand twice, a conductivity that is not positive, or
            a change that leaves the system singular to working precision; it names the touch.
        """
        grounded, lost = self._changed(touches)
        checked_voltages(self._model, grounded, lost)
        return centred(grounded)

    def voltages_of(self, touches: Sequence[Touch]) -> NDArray[Any]:
        """(n_touches, n_meas) V; see :meth:`transfer_resistances_of`."""
        return checked_voltages(self._model, *self._changed(touches))

    def _changed(self, touches: Sequence[Touch]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Transfer resistance against the ground electrode, and what rounding may cost it."""
        if self._conductivity.ndim > 1:
            raise ModelError("a local update needs a scalar conductivity")
        joined = Touches.of(touches, self._base.basis.dtype)
        if len(joined.cells) <= MOST_CELLS or np.diff(joined.starts).max() <= MOST_CELLS:
            return self._by_patches(joined)
        if len(joined) > 1:
            single = [self._changed([joined[number]]) for number in range(len(joined))]
            grounded, lost = zip(*single, strict=True)
            return np.concatenate(grounded), np.concatenate(lost)
        return self._factorised(joined)

    def _factorised(self, touch: Touches) -> tuple[NDArray[Any], NDArray[Any]]:
        """Results of a large patch; the new state checks its own voltages."""
        touch.check(len(self._conductivity))
        kind = np.result_type(self._conductivity, touch.conductivity)
        changed = self._conductivity.astype(kind)
        changed[touch.cells] = touch.conductivity
        grounded = Solution(self._model, changed).basis[self._model.assembly.n_points :]
        return grounded[None], np.zeros_like(grounded)[None]

    def _by_patches(self, touches: Touches) -> tuple[NDArray[Any], NDArray[Any]]:
        arrays = touches.starts, touches.cells, touches.conductivity
        try:
            grounded, lost, missing = self._patches.change(*arrays)
            while len(missing):
                if len(touches) > 1 and self._size(len(missing)) > MOST_BYTES:
                    return self._by_halves(touches)
                self._need(missing)
                grounded, lost, missing = self._patches.change(*arrays)
        except ValueError as error:
            touches.check(len(self._conductivity))
            raise singular() from error
        return grounded, lost

    def _by_halves(self, touches: Touches) -> tuple[NDArray[Any], NDArray[Any]]:
        """Results of more touches than the store has room for."""
        end = len(touches)
        parts = touches.part(0, end // 2), touches.part(end // 2, end)
        grounded, lost = zip(*map(self._by_patches, parts), strict=True)
        return np.concatenate(grounded), np.concatenate(lost)

    @cached_property
    def _patches(self) -> Patches:
        return self._model.engine.patches(base_state(self._base))

    def _size(self, n_columns: int) -> int:
        return n_columns * self._model.assembly.n_points * self._base.basis.itemsize

    def _need(self, missing: IntArray) -> None:
        """Compute the columns of nodes; where the store is full, empty it for the next attempt."""
        stored = int(np.count_nonzero(self._stored))
        if stored and self._size(stored + len(missing)) > MOST_BYTES:
            self._patches.forget()
            self._stored[:] = False
            return
        columns = self._base.factor.columns(missing)
        self._patches.keep(missing, columns[: self._model.assembly.n_points])
        self._stored[missing] = True


def base_state(solution: Solution) -> BaseState:
    """What touches change of it; it has a scalar conductivity."""
    element, basis = solution.model.assembly.element, solution.basis
    held = np.zeros(element.n_nodes, dtype=bool)
    for facets in element.facets:
        held[facets] = True
    return BaseState(
        cells=element.cells,
        local=np.einsum("nqid,nqjd->nij", element.gradients, element.gradients),
        held=held,
        conductivity=solution.conductivity.astype(basis.dtype),
        fields=basis[: element.n_nodes],
        grounded=basis[element.n_nodes :],
    )
