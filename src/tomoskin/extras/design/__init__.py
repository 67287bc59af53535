"""What a skin can resolve before it is built: bounds of positions and of the faintest press."""

from tomoskin.extras.design.bounds import (
    Demand as Demand,
    ResolutionBounds as ResolutionBounds,
    resolution_bounds as resolution_bounds,
    variants as variants,
)
