"""An operator that is made piece by piece, so that nothing else has to wait for it."""

from __future__ import annotations

import numpy as np

from tomoskin.inverse.operator import Operator
from tomoskin.inverse.spectrum import Spectrum


class Assembly:
    """The operator of ``alpha`` from a spectrum, some of its rows at a time."""

    def __init__(self, spectrum: Spectrum, alpha: float) -> None:
        self._spectrum = spectrum
        self._alpha = alpha
        self._filtered = spectrum.filtered(alpha)
        self._matrix = np.empty_like(spectrum.modes)
        self._made = 0

    @property
    def done(self) -> bool:
        """Whether every row is there."""
        return self._made == len(self._matrix)

    def advance(self, rows: int) -> None:
        """Make the next ``rows`` rows, or as many as are left."""
        piece = slice(self._made, min(self._made + rows, len(self._matrix)))
        np.matmul(self._spectrum.modes[piece], self._filtered, out=self._matrix[piece])
        self._made = piece.stop

    def operator(self) -> Operator:
        """The operator, once it is :attr:`done`."""
        return self._spectrum.operator_of(self._alpha, self._matrix)
