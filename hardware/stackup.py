"""The layers of the boards, from the front: what a factory's usual four layers of 1.6 mm are."""

from __future__ import annotations

import math
from dataclasses import dataclass

_EPSILON = 8.854e-12
_PREPREG, _PREPREG_ER = 0.2104, 4.4
"""mm of one sheet of 7628, and its permittivity."""

VIA_OHMS = 1.72e-8 * 1.6e-3 / (math.pi * 0.3e-3 * 20e-6)
"""Through the board: a hole of 0.3 mm, plated with 20 µm."""


@dataclass(frozen=True)
class Layer:
    """A layer of copper.

    ``thickness`` and ``height`` (to the ground plane or pour next to it), mm; ``permittivity`` of
    what is between; ``buried``: inside the board; ``ipc``: IPC-2221's k of the current it carries.
    """

    thickness: float
    height: float
    permittivity: float
    buried: bool

    @property
    def ipc(self) -> float:
        """0.048 on the surface, half of it inside."""
        return 0.024 if self.buried else 0.048

    def per_metre(self, width: float) -> float:
        """Capacitance of a track of ``width`` mm over its plane, F/m (Hammerstad, microstrip)."""
        ratio, er = width / self.height, self.permittivity
        inside = (er + 1) / 2 + (er - 1) / 2 / math.sqrt(1 + 12 / ratio)
        effective = er if self.buried else inside
        if ratio < 1:
            return 2 * math.pi * _EPSILON * effective / math.log(8 / ratio + ratio / 4)
        return _EPSILON * effective * (ratio + 1.393 + 0.667 * math.log(ratio + 1.444))


LAYERS = {
    "F.Cu": Layer(0.035, _PREPREG, _PREPREG_ER, False),
    "In1.Cu": Layer(0.0152, _PREPREG, _PREPREG_ER, True),
    "In2.Cu": Layer(0.0152, _PREPREG, _PREPREG_ER, True),
    "B.Cu": Layer(0.035, _PREPREG, _PREPREG_ER, False),
}
"""Front, ground, rails, back; below the rails is the back's pour of ground."""
