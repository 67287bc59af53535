"""Records, errors and units that every other room speaks in."""

from tomoskin.core.errors import (
    DataError,
    GeometryError,
    ModelError,
    PatternError,
    SkinError,
    SourceError,
    TomoskinError,
    WireError,
)
from tomoskin.core.records import (
    ComplexArray,
    Event,
    FloatArray,
    Frame,
    Image,
    IntArray,
    Reading,
    Touch,
    Voltages,
)
from tomoskin.core.units import DIMENSIONS, parse_quantity

__all__ = [
    "DIMENSIONS",
    "ComplexArray",
    "DataError",
    "Event",
    "FloatArray",
    "Frame",
    "GeometryError",
    "Image",
    "IntArray",
    "ModelError",
    "PatternError",
    "Reading",
    "SkinError",
    "SourceError",
    "TomoskinError",
    "Touch",
    "Voltages",
    "WireError",
    "parse_quantity",
]
