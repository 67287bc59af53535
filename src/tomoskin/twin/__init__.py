"""A skin without hardware: presses → conductivity → potentials → counts → bytes."""

from tomoskin.twin.board import Board, sample_table
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.press import ContactSettings, Press, depth, relative_conductivity
from tomoskin.twin.readout import Analogue, SampleTable, TwinElectronics, convert, potentials
from tomoskin.twin.sheet import TwinSettings, TwinSkin
from tomoskin.twin.source import make_twin, open_twin
from tomoskin.twin.transport import Clock, TwinTransport, WallClock

__all__ = [
    "Analogue",
    "Board",
    "Clock",
    "ContactSettings",
    "Press",
    "SampleTable",
    "TwinDevice",
    "TwinElectronics",
    "TwinSettings",
    "TwinSkin",
    "TwinTransport",
    "WallClock",
    "convert",
    "depth",
    "make_twin",
    "open_twin",
    "potentials",
    "relative_conductivity",
    "sample_table",
]
