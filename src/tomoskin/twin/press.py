"""A press on a sheet over foam, and what it does to the sheet's conductivity."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import i0e, i1e, k0e, k1e

from tomoskin.core import FloatArray, GeometryError, ModelError
from tomoskin.mesh import Outline


@dataclass(frozen=True, slots=True)
class Press:
    """A round probe pressed on the sheet.

    ``x``, ``y`` and ``radius`` in m, ``force`` in N (0: it only rests there).

    Raises
    ------
    GeometryError
        When a place or radius is not finite, or the radius is not above 0.
    ModelError
        When the force is negative or not finite.
    """

    x: float
    y: float
    force: float
    radius: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        if not (math.isfinite(self.x) and math.isfinite(self.y)):
            raise GeometryError(f"expected a finite place, got ({self.x}, {self.y})", where="press")
        if not 0 < self.radius < math.inf:
            raise GeometryError(f"expected a radius above 0 m, got {self.radius}", where="press")
        if not 0 <= self.force < math.inf:
            raise ModelError(
                f"expected a force of 0 N or more, got {self.force}",
                where="press",
                hint="a probe can push, not pull",
            )


@dataclass(frozen=True)
class ContactSettings:
    """Sheet and foam; typical of a silver-plated knit on soft foam, assumed, not measured.

    Attributes
    ----------
    foam_modulus
        Young's modulus of the foam, Pa.
    foam_thickness
        m.
    tension
        Tension of the sheet, N/m.
    stretch_per_depth
        Strain of the sheet per depth of the dent, 1/m: the sheet is drawn into the dent.
    gauge_factor
        Relative rise of sheet resistance per strain.
    """

    foam_modulus: float = 30e3
    foam_thickness: float = 10e-3
    tension: float = 200.0
    stretch_per_depth: float = 20.0
    gauge_factor: float = 15.0

    @property
    def foundation(self) -> float:
        """Stiffness of the foam per area, Pa/m (Winkler)."""
        return self.foam_modulus / self.foam_thickness

    @property
    def spread(self) -> float:
        """How far a dent reaches beyond the probe, m: √(tension / foundation)."""
        return math.sqrt(self.tension / self.foundation)


def depth(press: Press, settings: ContactSettings, points: FloatArray) -> FloatArray:
    """(n,) depth of the dent at ``points`` (n, 2), m.

    A membrane on a Winkler foundation, T∇²w − kw = −p, under an even pressure p = F/πR² on the
    probe's face. With a = R/ℓ, ρ = r/ℓ and ℓ² = T/k: inside, w = p/k · (1 − a K₁(a) I₀(ρ));
    outside, w = p/k · a I₁(a) K₀(ρ). Depth and slope are continuous. The sheet is taken as endless.
    """
    a = press.radius / settings.spread
    rho = np.hypot(points[:, 0] - press.x, points[:, 1] - press.y) / settings.spread
    inner, outer = np.minimum(rho, a), np.maximum(rho, a)
    inside = 1.0 - a * k1e(a) * i0e(inner) * np.exp(inner - a)
    outside = a * i1e(a) * k0e(outer) * np.exp(a - outer)
    pressure = press.force / (math.pi * press.radius**2)
    return np.asarray(pressure / settings.foundation * np.where(rho < a, inside, outside))


def relative_conductivity(
    presses: Sequence[Press], settings: ContactSettings, points: FloatArray
) -> FloatArray:
    """(n,) σ/σ₀ at ``points`` (n, 2): 1 / (1 + gauge · stretch · Σ depth), 1 without a press.

    Conductivity falls where the sheet is stretched. The depths of several presses add up, as
    the foam is linear.
    """
    total = sum((depth(press, settings, points) for press in presses), np.zeros(len(points)))
    return np.asarray(1.0 / (1.0 + settings.gauge_factor * settings.stretch_per_depth * total))


def check_on_skin(presses: Sequence[Press], outline: Outline) -> None:
    """Raise GeometryError that names the first press whose centre is off the skin."""
    if not presses:
        return
    inside = outline.contains(np.array([(press.x, press.y) for press in presses]))
    if not inside.all():
        number = int(np.argmin(inside))
        x, y = presses[number].x * 1e3, presses[number].y * 1e3
        raise GeometryError(
            f"its centre ({x:.1f} mm, {y:.1f} mm) is off the skin", where=f"press {number}"
        )
