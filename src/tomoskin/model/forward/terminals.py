"""The resistance between the electrodes, and nothing else, of one conductivity after another.

The electrodes' unknowns are eliminated last: what the sheet leaves between them is the end of the
factor, and no field is solved for. It is the transfer resistance of a :class:`State`, but for
rounding; the fields, with which that checks itself, are not there. Instead each pivot of an
electrode must keep more than a few of its digits.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.model.forward.engine import singular
from tomoskin.model.forward.model import ForwardModel, State


class Terminals:
    """What a model's electrodes see of it.

    Natively in a third of the time of a state; else, or where a contact is complex, by a state.
    """

    def __init__(self, model: ForwardModel) -> None:
        self._model = model

    def transfer_resistance(self, conductivity: FloatArray) -> NDArray[Any]:
        """(n_electrodes, n_electrodes) Ω for (n_cells,) S or S/m, or a tensor per cell (…, d, d).

        The conductivity is not checked: it must be positive, and a tensor symmetric.

        Raises
        ------
        ModelError
            When the system is singular to working precision.
        """
        if self._model.engine.core is None or np.iscomplexobj(self._model.contacts):
            return np.asarray(State(self._model, conductivity).transfer_resistance)
        if conductivity.ndim == 1:
            network, components = self._scalar, conductivity[None, None]
        else:
            network, components = self._tensor, conductivity.transpose(1, 2, 0)
        try:
            resistance: FloatArray = network.resistance(np.ascontiguousarray(components))
        except ValueError as error:
            raise singular() from error
        return resistance

    @cached_property
    def _scalar(self) -> Any:
        return self._network(self._model.assembly.element.forms(), 1)

    @cached_property
    def _tensor(self) -> Any:
        element = self._model.assembly.element
        return self._network(element.tensor_forms(), element.gradients.shape[3])

    def _network(self, forms: FloatArray, axes: int) -> Any:
        """The native layout, for the ``forms`` (n_cells, k, k, components) of so many axes."""
        assembly, core = self._model.assembly, self._model.engine.core
        if core is None:
            raise AssertionError("the layout needs the native engine")
        i, j = np.triu_indices(forms.shape[1], 1)
        return core.Terminals(
            assembly.indptr,
            assembly.indices,
            self._model.contacts,
            np.ascontiguousarray(assembly.position, np.int32),
            np.ascontiguousarray(forms[:, i, j].transpose(2, 1, 0)),
            axes,
            np.arange(assembly.n_points, assembly.n_unknowns, dtype=np.int32),
        )
