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
from tomoskin.core.inputs import check_is_file, open_input
from tomoskin.core.outputs import MAGIC, RECORDING, Output, StrPath, check_outputs
from tomoskin.core.stages import finished, reach, watch_stages
from tomoskin.core.units import DIMENSIONS, parse_quantity
from tomoskin.core.written import write_text, written

if TYPE_CHECKING:
    from tomoskin.core.archive import Arrays, load_arrays, pack_arrays, save_arrays, unpack_arrays
    from tomoskin.core.cache import cache_folder, kept
    from tomoskin.core.clocks import Clock, VirtualClock, WallClock, clock_ahead
    from tomoskin.core.colours import AMOUNT, CHANGE, CHANGE_ON_DARK, ColourScale
    from tomoskin.core.extras import install_hint, needed
    from tomoskin.core.json_bytes import encode_json, plain_values
    from tomoskin.core.memory import check_fits, machine_memory, most_bytes
    from tomoskin.core.records import (
        ComplexArray,
        DeferredImage,
        Detection,
        Event,
        FloatArray,
        Force,
        Frame,
        Image,
        IntArray,
        Mark,
        MarkedFrame,
        PixelMap,
        Touch,
        Voltages,
    )
    from tomoskin.core.typed_arrays import (
        MOST_ELECTRODES,
        electrode_table,
        numbers,
        real_numbers,
        whole_number,
    )
    from tomoskin.core.worker import Capacity, Consumer, Say, Worker, stop_workers

_HOME = {
    "AMOUNT": "colours",
    "Arrays": "archive",
    "CHANGE": "colours",
    "CHANGE_ON_DARK": "colours",
    "ColourScale": "colours",
    "check_fits": "memory",
    "MOST_ELECTRODES": "typed_arrays",
    "electrode_table": "typed_arrays",
    "encode_json": "json_bytes",
    "cache_folder": "cache",
    "Capacity": "worker",
    "Clock": "clocks",
    "Consumer": "worker",
    "Say": "worker",
    "VirtualClock": "clocks",
    "WallClock": "clocks",
    "Worker": "worker",
    "clock_ahead": "clocks",
    "install_hint": "extras",
    "needed": "extras",
    "kept": "cache",
    "load_arrays": "archive",
    "machine_memory": "memory",
    "most_bytes": "memory",
    "numbers": "typed_arrays",
    "pack_arrays": "archive",
    "plain_values": "json_bytes",
    "real_numbers": "typed_arrays",
    "save_arrays": "archive",
    "stop_workers": "worker",
    "unpack_arrays": "archive",
    "whole_number": "typed_arrays",
}
"""Where names live that need more, if not in ``records``: loaded when they are first asked for."""

__all__ = [
    "AMOUNT",
    "CHANGE",
    "CHANGE_ON_DARK",
    "DIMENSIONS",
    "EMPTY",
    "MAGIC",
    "MOST_ELECTRODES",
    "RECORDING",
    "Arrays",
    "Capacity",
    "Clock",
    "ColourScale",
    "ComplexArray",
    "Consumer",
    "DataError",
    "DeferredImage",
    "Detection",
    "Event",
    "FloatArray",
    "Force",
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
    "electrode_table",
    "encode_json",
    "finished",
    "install_hint",
    "kept",
    "load_arrays",
    "machine_memory",
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
    # numpy comes with them; the command line needs errors only until a command runs.
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"tomoskin.core.{_HOME.get(name, 'records')}"), name)
