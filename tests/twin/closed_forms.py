"""Dents that are known in closed form: a membrane on springs, and Hertz's ball."""

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


@dataclass(frozen=True)
class Hertz:
    """A ball of radius ``crown`` m pressed into a half-space (Johnson 1985, eqs. 4.22–4.24)."""

    force: float
    crown: float
    settings: ContactSettings

    @property
    def modulus(self) -> float:
        """E* of a rigid ball, Pa."""
        return self.settings.modulus / (1 - self.settings.poisson**2)

    @property
    def contact(self) -> float:
        """Radius of the contact, m."""
        return float((3 * self.force * self.crown / (4 * self.modulus)) ** (1 / 3))

    @property
    def travel(self) -> float:
        """m."""
        return self.contact**2 / self.crown

    @property
    def peak(self) -> float:
        """Largest pressure, Pa."""
        return 3 * self.force / (2 * math.pi * self.contact**2)
