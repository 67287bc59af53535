"""Records, errors and units that every other room speaks in."""

from tomoskin.core.errors import (
    DataError,
    GeometryError,
    ModelError,
    PatternError,
    ScriptError,
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
    PixelMap,
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
    "PixelMap",
    "Reading",
    "ScriptError",
    "SkinError",
    "SourceError",
    "TomoskinError",
    "Touch",
    "Voltages",
    "WireError",
    "parse_quantity",
]
