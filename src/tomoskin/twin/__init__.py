"""A skin without hardware: probes → dents → conductivity → potentials → counts → bytes."""

from tomoskin.twin.board import Board
from tomoskin.twin.circuit import Lines, line_potentials
from tomoskin.twin.contact import ContactSettings, Dented, Grid, solve_contact
from tomoskin.twin.dent import Load, indent
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.faults import FaultEvent, Faults, faults_at
from tomoskin.twin.line import FaultyLine, Line, LineSettings
from tomoskin.twin.material import MaterialSettings, MaterialState, advance, conductivity
from tomoskin.twin.probe import Contact, Press, Probe
from tomoskin.twin.readout import ElectronicsSettings, TwinElectronics, convert
from tomoskin.twin.scanning import Analogue, SampleTable, ScanClock, sample_table
from tomoskin.twin.settings import PRESETS, TwinSettings
from tomoskin.twin.shape import Circle, Face, Finger, Shape, Square
from tomoskin.twin.sheet import TwinSkin
from tomoskin.twin.source import make_electronics, make_twin, open_twin
from tomoskin.twin.transport import Clock, TwinTransport, WallClock

__all__ = [
    "PRESETS",
    "Analogue",
    "Board",
    "Circle",
    "Clock",
    "Contact",
    "ContactSettings",
    "Dented",
    "ElectronicsSettings",
    "Face",
    "FaultEvent",
    "Faults",
    "FaultyLine",
    "Finger",
    "Grid",
    "Line",
    "LineSettings",
    "Lines",
    "Load",
    "MaterialSettings",
    "MaterialState",
    "Press",
    "Probe",
    "SampleTable",
    "ScanClock",
    "Shape",
    "Square",
    "TwinDevice",
    "TwinElectronics",
    "TwinSettings",
    "TwinSkin",
    "TwinTransport",
    "WallClock",
    "advance",
    "conductivity",
    "convert",
    "faults_at",
    "indent",
    "line_potentials",
    "make_electronics",
    "make_twin",
    "open_twin",
    "sample_table",
    "solve_contact",
]
