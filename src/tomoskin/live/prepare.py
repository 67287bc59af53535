"""The model flow: from a skin to everything that a frame needs, made once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tomoskin.forward import ForwardModel
from tomoskin.inverse import OneStep
from tomoskin.mesh import Mesh
from tomoskin.pattern import Pattern, Scan
from tomoskin.signal import Readout, Reference
from tomoskin.skin import Skin
from tomoskin.touch import NoiseFloor, Segmenter


@dataclass(frozen=True, eq=False)
class Prepared:
    """What was made once for a skin.

    Attributes
    ----------
    skin, mesh, pattern, scan, model, operator, segmenter, readout
        The stages, in the order of the flow.
    """

    skin: Skin
    mesh: Mesh
    pattern: Pattern
    scan: Scan
    model: ForwardModel
    operator: OneStep
    segmenter: Segmenter
    readout: Readout

    def noise_floor(self, reference: Reference) -> NoiseFloor | None:
        """What the noise of a reference does to the picture; None where it is not known."""
        if not reference.noise_is_known:
            return None
        normalised = self.operator.difference == "normalised"
        noise = reference.noise / np.abs(reference.mean) if normalised else reference.noise
        return NoiseFloor.of(self.operator.matrix, noise)


def prepare(skin: Skin) -> Prepared:
    """Mesh, model, operator and stages of ``skin``.

    Raises
    ------
    TomoskinError
        When the skin cannot be meshed, modelled or inverted; the message says which.
    """
    mesh, pattern = skin.mesh(), skin.pattern()
    scan = Scan.of(pattern)
    model = ForwardModel(mesh, pattern, skin.contact_impedance, skin.current)
    settings = skin.inverse
    operator = OneStep(
        model,
        settings.prior,
        alpha=settings.alpha,
        conductivity=skin.conductivity,
        difference=settings.difference,
    )
    return Prepared(
        skin=skin,
        mesh=mesh,
        pattern=pattern,
        scan=scan,
        model=model,
        operator=operator,
        segmenter=Segmenter(mesh, skin.touch),
        readout=Readout.of(scan, skin.readout),
    )
