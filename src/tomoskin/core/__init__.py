"""Records, errors and units that every other room speaks in."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tomoskin.core.errors import (
    EMPTY as EMPTY,
    DataError as DataError,
    GeometryError as GeometryError,
    ModelError as ModelError,
    OutputError as OutputError,
    PatternError as PatternError,
    ScriptError as ScriptError,
    SinkError as SinkError,
    SkinError as SkinError,
    SourceError as SourceError,
    TomoskinError as TomoskinError,
    WireError as WireError,
    check_positive as check_positive,
    located as located,
    meant as meant,
    meant_or_known as meant_or_known,
    no_such as no_such,
)
from tomoskin.core.later import later as later
from tomoskin.core.seams import (
    Registered as Registered,
    Seam as Seam,
    extra_names as extra_names,
    registered as registered,
    registered_one as registered_one,
)
from tomoskin.core.stages import (
    finished as finished,
    observe_steps as observe_steps,
    reach as reach,
    show as show,
    watch_stages as watch_stages,
)
from tomoskin.core.units import DIMENSIONS as DIMENSIONS, parse_quantity as parse_quantity
from tomoskin.core.user_files import (
    MAGIC as MAGIC,
    RECORDING as RECORDING,
    Output as Output,
    StrPath as StrPath,
    check_fits as check_fits,
    check_is_file as check_is_file,
    check_outputs as check_outputs,
    disk_refusals as disk_refusals,
    most_bytes as most_bytes,
    open_input as open_input,
    read_refusals as read_refusals,
    write_rows as write_rows,
    write_text as write_text,
    written as written,
)

if TYPE_CHECKING:
    from tomoskin.core.archive import (
        MOST_ELECTRODES as MOST_ELECTRODES,
        Arrays as Arrays,
        cache_folder as cache_folder,
        electrode_table as electrode_table,
        kept as kept,
        load_arrays as load_arrays,
        numbers as numbers,
        numeric as numeric,
        pack_arrays as pack_arrays,
        real_numbers as real_numbers,
        refuse_first as refuse_first,
        save_arrays as save_arrays,
        unpack_arrays as unpack_arrays,
        whole_number as whole_number,
    )
    from tomoskin.core.clocks import (
        Clock as Clock,
        VirtualClock as VirtualClock,
        WallClock as WallClock,
        clock_ahead as clock_ahead,
    )
    from tomoskin.core.colours import (
        AMOUNT as AMOUNT,
        CHANGE as CHANGE,
        CHANGE_ON_DARK as CHANGE_ON_DARK,
    )
    from tomoskin.core.extras import install_hint as install_hint, needed as needed
    from tomoskin.core.json_bytes import encode_json as encode_json, plain_values as plain_values
    from tomoskin.core.records import (
        MEASURANDS as MEASURANDS,
        Amount as Amount,
        ComplexArray as ComplexArray,
        DeferredImage as DeferredImage,
        Detection as Detection,
        DriveSamples as DriveSamples,
        Event as Event,
        FloatArray as FloatArray,
        Frame as Frame,
        Image as Image,
        IntArray as IntArray,
        Mark as Mark,
        MarkedFrame as MarkedFrame,
        PixelMap as PixelMap,
        Touch as Touch,
        Voltages as Voltages,
    )
    from tomoskin.core.worker import (
        Capacity as Capacity,
        Consumer as Consumer,
        Say as Say,
        Worker as Worker,
        stop_workers as stop_workers,
    )

_LATER = ("records", "worker", "clocks", "json_bytes", "extras", "colours", "archive")
"""Modules that need more, numpy for one, and are loaded when one of their names is first asked for:
the command line needs errors only until a command runs."""


def __getattr__(name: str) -> Any:
    for module in () if name.startswith("_") else _LATER:
        later = import_module(f"tomoskin.core.{module}")
        if hasattr(later, name):
            return globals().setdefault(name, getattr(later, name))
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
