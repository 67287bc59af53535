"""The layers of the boards, from the front: what a factory's usual four layers of 1.6 mm are."""

from __future__ import annotations

import math
from dataclasses import dataclass

_EPSILON = 8.854e-12
_PREPREG, _CORE, _MASK = 0.2104, 1.065, 0.01
"""mm; the prepreg is one sheet of 7628."""

_PREPREG_ER, _CORE_ER = 4.4, 4.6
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


def kicad() -> str:
    """The same, as a .kicad_pcb has it."""

    def copper(name: str) -> str:
        return f'\t\t\t(layer "{name}" (type "copper") (thickness {LAYERS[name].thickness}))'

    def insulator(number: int, kind: str, thickness: float, er: float) -> str:
        return (
            f'\t\t\t(layer "dielectric {number}" (type "{kind}") (thickness {thickness}) '
            f'(material "FR4") (epsilon_r {er}) (loss_tangent 0.02))'
        )

    def mask(side: str, name: str) -> str:
        return (
            f'\t\t\t(layer "{side}.Mask" (type "{name} Solder Mask") (color "Green") '
            f"(thickness {_MASK}))"
        )

    lines = [
        mask("F", "Top"),
        copper("F.Cu"),
        insulator(1, "prepreg", _PREPREG, _PREPREG_ER),
        copper("In1.Cu"),
        insulator(2, "core", _CORE, _CORE_ER),
        copper("In2.Cu"),
        insulator(3, "prepreg", _PREPREG, _PREPREG_ER),
        copper("B.Cu"),
        mask("B", "Bottom"),
    ]
    tail = ['\t\t\t(copper_finish "HAL lead-free")', "\t\t\t(dielectric_constraints no)"]
    return "\n".join(["\t\t(stackup", *lines, *tail, "\t\t)"]) + "\n"
