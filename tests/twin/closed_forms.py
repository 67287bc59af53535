"""Dents that are known in closed form: a membrane on springs, a ball on an elastic layer."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import i0, i1, k0, k1

from tomoskin.core import FloatArray
from tomoskin.twin import ContactSettings


def even_pressure_depth(
    force: float, radius: float, settings: ContactSettings, r: FloatArray
) -> FloatArray:
    """(n,) m under an even pressure on a disc: T∇²w − kw = −p by Bessel functions.

    With a = R/ℓ, ρ = r/ℓ and ℓ² = T/k: inside w = p/k · (1 − a K₁(a) I₀(ρ)), outside
    w = p/k · a I₁(a) K₀(ρ).
    """
    a, rho = radius / settings.reach, r / settings.reach
    pressure = force / (math.pi * radius**2)
    inside = 1.0 - a * k1(a) * i0(np.minimum(rho, a))
    outside = a * i1(a) * k0(np.maximum(rho, a))
    return np.asarray(pressure / settings.spring * np.where(rho < a, inside, outside))


def flat_punch_stiffness(radius: float, settings: ContactSettings) -> float:
    """N/m of a rigid flat punch: what the springs under it bear, and the pull at its rim.

    F/w = kπR² + 2πR T/ℓ · K₁(a)/K₀(a), as w = w₀ K₀(ρ)/K₀(a) outside.
    """
    a = radius / settings.reach
    rim = 2 * math.pi * radius * settings.tension / settings.reach * k1(a) / k0(a)
    return float(settings.spring * math.pi * radius**2 + rim)


@dataclass(frozen=True)
class BallOnSprings:
    """A paraboloid r²/2R on a membrane over springs, touching within ``reach`` m.

    Inside w = δ − r²/2R and p = kw + 2T/R; outside w = A K₀(ρ); depth and slope go on.
    """

    crown: float
    contact: float
    settings: ContactSettings

    @property
    def edge(self) -> float:
        """Depth at the rim of the contact, m."""
        a = self.contact / self.settings.reach
        return float(self.contact / self.crown * self.settings.reach * k0(a) / k1(a))

    @property
    def travel(self) -> float:
        """m."""
        return self.edge + self.contact**2 / (2 * self.crown)

    @property
    def force(self) -> float:
        """∫ p over the contact, N."""
        c, crown = self.contact, self.crown
        volume = math.pi * c**2 * self.travel - math.pi * c**4 / (4 * crown)
        return self.settings.spring * volume + 2 * math.pi * c**2 * self.settings.tension / crown


def force_on_a_layer(crown: float, travel: float, settings: ContactSettings) -> float:
    """N of a paraboloid on an incompressible layer glued to its base.

    Garcia & Garcia 2018, Biophys. J. 114, 2923; on a thick one that of Hertz (Johnson 1985, 4.2).
    """
    x = math.sqrt(crown * travel) / settings.thickness
    more = 1 + 1.133 * x + 1.497 * x**2 + 1.469 * x**3 + 0.755 * x**4
    return 16 / 9 * settings.modulus * math.sqrt(crown) * travel**1.5 * more
