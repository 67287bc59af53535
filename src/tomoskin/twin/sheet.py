"""The twin's sheet: presses → conductivity → resistance between the electrodes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.forward import ForwardModel
from tomoskin.mesh import Outline, triangulate
from tomoskin.twin.press import ContactSettings, Press, check_on_skin, relative_conductivity

if TYPE_CHECKING:
    from tomoskin.skin import Skin

_MESH_SEED = 7919
"""Seed of the twin's mesh; the reconstruction's is another, so no mesh is ever shared."""


@dataclass(frozen=True)
class TwinSettings:
    """What a twin adds to its skin.

    Attributes
    ----------
    seed
        Of the noise: the same seed gives the same bytes.
    noise
        Standard deviation of one conversion before it is rounded, in LSB.
    mesh_ratio
        Cells of the twin's mesh per cell of the reconstruction's.
    contact
        Sheet and foam.
    """

    seed: int = 0
    noise: float = 0.7
    mesh_ratio: float = 1.6
    contact: ContactSettings = field(default_factory=ContactSettings)


class TwinSkin:
    """A sheet with electrodes on a mesh of its own; solved again only when a press changes."""

    def __init__(
        self,
        model: ForwardModel,
        outline: Outline,
        conductivity: float,
        contact: ContactSettings | None = None,
    ) -> None:
        """``conductivity`` of the sheet at rest, S; ``model`` on the twin's own mesh."""
        self.model = model
        self._outline = outline
        self._conductivity = conductivity
        self._contact = contact or ContactSettings()
        self._presses: tuple[Press, ...] = ()
        self._solved_for: tuple[Press, ...] | None = None
        self._resistance: FloatArray = np.empty((0, 0))
        self.solves = 0

    @classmethod
    def of(cls, skin: Skin, settings: TwinSettings) -> Self:
        """The twin of a skin, on a finer mesh from another seed."""
        cells = round(settings.mesh_ratio * skin.mesh_cells)
        mesh = triangulate(skin.outline, skin.arcs, cells, seed=_MESH_SEED)
        model = ForwardModel(
            mesh, skin.pattern(), contact_impedance=skin.contact_impedance, current=skin.current
        )
        return cls(model, skin.outline, skin.conductivity, settings.contact)

    @property
    def presses(self) -> tuple[Press, ...]:
        """What presses on the sheet now."""
        return self._presses

    def set_presses(self, presses: tuple[Press, ...]) -> None:
        """Replace all presses at once, from any thread.

        Raises
        ------
        GeometryError
            When the centre of one is off the skin; then nothing is changed.
        """
        check_on_skin(presses, self._outline)
        self._presses = tuple(presses)

    def conductivity(self, presses: tuple[Press, ...]) -> FloatArray:
        """(n_cells,) S under ``presses``."""
        centroids = self.model.mesh.centroids
        return self._conductivity * relative_conductivity(presses, self._contact, centroids)

    def resistance(self) -> FloatArray:
        """(n_electrodes, n_electrodes) Ω under the present presses.

        The same array as before unless a press has changed.
        """
        presses = self._presses
        if presses != self._solved_for:
            sigma = self.conductivity(presses)
            self._resistance = np.asarray(self.model.transfer_resistance(sigma))
            self._solved_for = presses
            self.solves += 1
        return self._resistance
