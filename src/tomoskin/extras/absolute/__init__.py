"""Images of conductivity itself, of its edges and of regions, by iterations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tomoskin.core import later

if TYPE_CHECKING:
    from tomoskin.extras.absolute.absolute import (
        Absolute as Absolute,
        AbsoluteImaging as AbsoluteImaging,
        SharpDifference as SharpDifference,
        homogeneous as homogeneous,
    )
    from tomoskin.extras.absolute.shapes import (
        RandomField as RandomField,
        Segmented as Segmented,
        ShapeImaging as ShapeImaging,
    )
    from tomoskin.extras.absolute.sharpened import sharpened as sharpened
    from tomoskin.extras.absolute.unknowns import Observation as Observation

__getattr__ = later(__name__, "unknowns", "absolute", "shapes", "sharpened")
