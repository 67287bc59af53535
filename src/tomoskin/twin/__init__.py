"""A skin without hardware: probes → dents → conductivity → potentials → counts → bytes."""

from tomoskin.twin.bend import BendSettings, Bent, Deformation, Pose, Stretched
from tomoskin.twin.circuit import ElectronicsSettings, ThermalVoltages
from tomoskin.twin.contact import ContactSettings, Grid, solve_contact
from tomoskin.twin.course import Disturbance, bent, bent_truth, disturbed, pressed, reboots
from tomoskin.twin.faults import Faults, Line, LineSettings
from tomoskin.twin.held_scanning import Board, HeldScanning, Question, Setting
from tomoskin.twin.labelled import COMMON_PRESSES, Population, SetPlan, make_shard
from tomoskin.twin.material import MaterialSettings
from tomoskin.twin.presets import PRESETS, TwinSettings
from tomoskin.twin.probe import FACES, Circle, Face, Finger, Press, Probe, Shape, Square
from tomoskin.twin.scanning import (
    SampleTable,
    ScanClock,
    chopped_table,
    sample_table,
    table_of,
)
from tomoskin.twin.script import Script
from tomoskin.twin.script_check import check_script, check_settling
from tomoskin.twin.sheet import TwinSkin
from tomoskin.twin.source import (
    SheetTransport,
    TwinTransport,
    make_electronics,
    make_twin,
    on_converter,
    read_board,
    read_settings,
)
from tomoskin.twin.stepped import SteppedSkin

__all__ = [
    "COMMON_PRESSES",
    "FACES",
    "PRESETS",
    "BendSettings",
    "Bent",
    "Board",
    "Circle",
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
    "MaterialSettings",
    "Population",
    "Pose",
    "Press",
    "Probe",
    "Question",
    "SampleTable",
    "ScanClock",
    "Script",
    "SetPlan",
    "Setting",
    "Shape",
    "SheetTransport",
    "Square",
    "SteppedSkin",
    "Stretched",
    "ThermalVoltages",
    "TwinSettings",
    "TwinSkin",
    "TwinTransport",
    "bent",
    "bent_truth",
    "check_script",
    "check_settling",
    "chopped_table",
    "disturbed",
    "make_electronics",
    "make_shard",
    "make_twin",
    "on_converter",
    "pressed",
    "read_board",
    "read_settings",
    "reboots",
    "sample_table",
    "solve_contact",
    "table_of",
]
