"""Records, errors and units that every other room speaks in."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tomoskin.core.errors import (
    EMPTY,
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
    meant,
)
from tomoskin.core.inputs import check_fits, check_is_file, most_bytes, open_input
from tomoskin.core.outputs import (
    MAGIC,
    RECORDING,
    Output,
    StrPath,
    check_outputs,
    disk_refusals,
    write_text,
    written,
)
from tomoskin.core.stages import finished, reach, watch_stages
from tomoskin.core.units import DIMENSIONS, parse_quantity

if TYPE_CHECKING:
    from tomoskin.core.archive import (
        MOST_ELECTRODES,
        Arrays,
        cache_folder,
        electrode_table,
        kept,
        load_arrays,
        numbers,
        pack_arrays,
        real_numbers,
        save_arrays,
        unpack_arrays,
        whole_number,
    )
    from tomoskin.core.clocks import Clock, VirtualClock, WallClock, clock_ahead
    from tomoskin.core.colours import AMOUNT, CHANGE, CHANGE_ON_DARK
    from tomoskin.core.extras import install_hint, needed
    from tomoskin.core.json_bytes import encode_json, plain_values
    from tomoskin.core.records import (
        MEASURANDS,
        Amount,
        ComplexArray,
        DeferredImage,
        Detection,
        DriveSamples,
        Event,
        FloatArray,
        Frame,
        Image,
        IntArray,
        Mark,
        MarkedFrame,
        PixelMap,
        Touch,
        Voltages,
    )
    from tomoskin.core.worker import Capacity, Consumer, Say, Worker, stop_workers

_LATER = ("records", "worker", "clocks", "json_bytes", "extras", "colours", "archive")
"""Modules that need more, numpy for one, and are loaded when one of their names is first asked for:
the command line needs errors only until a command runs."""

__all__ = [
    "AMOUNT",
    "CHANGE",
    "CHANGE_ON_DARK",
    "DIMENSIONS",
    "EMPTY",
    "MAGIC",
    "MEASURANDS",
    "MOST_ELECTRODES",
    "RECORDING",
    "Amount",
    "Arrays",
    "Capacity",
    "Clock",
    "ComplexArray",
    "Consumer",
    "DataError",
    "DeferredImage",
    "Detection",
    "DriveSamples",
    "Event",
    "FloatArray",
    "Frame",
    "GeometryError",
    "Image",
    "IntArray",
    "Mark",
    "MarkedFrame",
    "ModelError",
    "Output",
    "OutputError",
    "PatternError",
    "PixelMap",
    "Say",
    "ScriptError",
    "SinkError",
    "SkinError",
    "SourceError",
    "StrPath",
    "TomoskinError",
    "Touch",
    "VirtualClock",
    "Voltages",
    "WallClock",
    "WireError",
    "Worker",
    "cache_folder",
    "check_fits",
    "check_is_file",
    "check_outputs",
    "clock_ahead",
    "disk_refusals",
    "electrode_table",
    "encode_json",
    "finished",
    "install_hint",
    "kept",
    "load_arrays",
    "meant",
    "most_bytes",
    "needed",
    "numbers",
    "open_input",
    "pack_arrays",
    "parse_quantity",
    "plain_values",
    "reach",
    "real_numbers",
    "save_arrays",
    "stop_workers",
    "unpack_arrays",
    "watch_stages",
    "whole_number",
    "write_text",
    "written",
]


def __getattr__(name: str) -> Any:
    for module in _LATER if name in __all__ else ():
        later = import_module(f"tomoskin.core.{module}")
        if hasattr(later, name):
            return globals().setdefault(name, getattr(later, name))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
