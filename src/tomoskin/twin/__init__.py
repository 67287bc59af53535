"""A skin without hardware: probes → dents → conductivity → potentials → counts → bytes."""

from tomoskin.twin.bend import BendSettings, Bent, Deformation, Pose, Stretched, strain_of
from tomoskin.twin.board import Board, HeldScanning
from tomoskin.twin.circuit import ElectronicsSettings, Lines, line_potentials
from tomoskin.twin.contact import ContactSettings, Grid, solve_contact
from tomoskin.twin.course import bent, bent_truth, pressed
from tomoskin.twin.dent import Load, indent
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.electrodes import ThermalVoltages
from tomoskin.twin.electronics import TwinElectronics, convert
from tomoskin.twin.faults import (
    Disturbance,
    Faults,
    Line,
    LineSettings,
    disturbed,
    reboots,
)
from tomoskin.twin.labelled import COMMON_PRESSES, Population, SetPlan, make_shard
from tomoskin.twin.material import MaterialSettings, MaterialState, advance, conductivity
from tomoskin.twin.presets import PRESETS, TwinSettings
from tomoskin.twin.probe import Contact, Press, Probe
from tomoskin.twin.scanning import (
    SampleTable,
    ScanClock,
    chopped_table,
    sample_table,
    table_of,
)
from tomoskin.twin.script import Script
from tomoskin.twin.script_check import check_script, check_settling
from tomoskin.twin.shape import FACES, Circle, Face, Finger, Shape, Square
from tomoskin.twin.sheet import TwinSkin
from tomoskin.twin.source import (
    TwinTransport,
    make_electronics,
    make_twin,
    on_converter,
    open_twin,
    read_settings,
)
from tomoskin.twin.stepped import Step, SteppedSkin

__all__ = [
    "COMMON_PRESSES",
    "FACES",
    "PRESETS",
    "BendSettings",
    "Bent",
    "Board",
    "Circle",
    "Contact",
    "ContactSettings",
    "Deformation",
    "Disturbance",
    "ElectronicsSettings",
    "Face",
    "Faults",
    "Finger",
    "Grid",
    "HeldScanning",
    "Line",
    "LineSettings",
    "Lines",
    "Load",
    "MaterialSettings",
    "MaterialState",
    "Population",
    "Pose",
    "Press",
    "Probe",
    "SampleTable",
    "ScanClock",
    "Script",
    "SetPlan",
    "Shape",
    "Square",
    "Step",
    "SteppedSkin",
    "Stretched",
    "ThermalVoltages",
    "TwinDevice",
    "TwinElectronics",
    "TwinSettings",
    "TwinSkin",
    "TwinTransport",
    "advance",
    "bent",
    "bent_truth",
    "check_script",
    "check_settling",
    "chopped_table",
    "conductivity",
    "convert",
    "disturbed",
    "indent",
    "line_potentials",
    "make_electronics",
    "make_shard",
    "make_twin",
    "on_converter",
    "open_twin",
    "pressed",
    "read_settings",
    "reboots",
    "sample_table",
    "solve_contact",
    "strain_of",
    "table_of",
]
