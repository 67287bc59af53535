"""Records, errors and units that every other room speaks in."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tomoskin.core.errors import (
    DataError,
    GeometryError,
    ModelError,
    OutputError,
    PatternError,
    ScriptError,
    SinkError,
    SkinError,
    SourceError,
    TomoskinError,
    WireError,
)
from tomoskin.core.units import DIMENSIONS, parse_quantity

if TYPE_CHECKING:
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
    "OutputError",
    "PatternError",
    "PixelMap",
    "Reading",
    "ScriptError",
    "SinkError",
    "SkinError",
    "SourceError",
    "TomoskinError",
    "Touch",
    "Voltages",
    "WireError",
    "parse_quantity",
]


def __getattr__(name: str) -> Any:
    # Records bring numpy with them; the command line needs errors only until a command runs.
    if name not in __all__:
        raise AttributeError(f"module 'tomoskin.core' has no attribute {name!r}")
    return getattr(import_module("tomoskin.core.records"), name)
