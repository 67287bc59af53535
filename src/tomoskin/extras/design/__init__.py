"""What a skin can resolve before it is built: bounds of positions and of the faintest press."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tomoskin.core import later

if TYPE_CHECKING:
    from tomoskin.extras.design.bounds import (
        Demand as Demand,
        ResolutionBounds as ResolutionBounds,
        resolution_bounds as resolution_bounds,
        variants as variants,
    )

__getattr__ = later(__name__, "bounds")
