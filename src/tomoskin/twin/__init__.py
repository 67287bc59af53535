"""A skin without hardware: probes → dents → conductivity → potentials → counts → bytes."""

from tomoskin.twin.bend import BendSettings, Bent, Deformation, Pose, Stretched, strain_of
from tomoskin.twin.board import Board, HeldScanning
from tomoskin.twin.circuit import ElectronicsSettings, Lines, line_potentials
from tomoskin.twin.contact import ContactSettings, Dented, Grid, solve_contact
from tomoskin.twin.course import ScriptedBend, bent, bent_truth, pressed
from tomoskin.twin.dent import Load, indent
from tomoskin.twin.device import TwinDevice
from tomoskin.twin.electrodes import ThermalVoltages
from tomoskin.twin.electronics import TwinElectronics, convert
from tomoskin.twin.faults import Disturbance, FaultEvent, Faults, disturbed, faults_at, reboots
from tomoskin.twin.layered import Inclusion, Layered, Plate
from tomoskin.twin.line import FaultyLine, Line, LineSettings
from tomoskin.twin.material import MaterialSettings, MaterialState, advance, conductivity
from tomoskin.twin.population import COMMON_PRESSES, Population
from tomoskin.twin.presets import PRESETS, TwinSettings
from tomoskin.twin.probe import Contact, Press, Probe
from tomoskin.twin.scanning import (
    Analogue,
    SampleTable,
    ScanClock,
    chopped_table,
    sample_table,
    table_of,
)
from tomoskin.twin.script import Script
from tomoskin.twin.script_check import check_script, check_settling
from tomoskin.twin.shape import FACES, Circle, Face, Finger, Shape, Square
from tomoskin.twin.shards import SetPlan, make_shard
from tomoskin.twin.sheet import TwinSkin
from tomoskin.twin.source import make_electronics, make_twin, open_twin, read_settings
from tomoskin.twin.stepped import Step, SteppedSkin
from tomoskin.twin.transport import TwinTransport

__all__ = [
    "COMMON_PRESSES",
    "FACES",
    "PRESETS",
    "Analogue",
    "BendSettings",
    "Bent",
    "Board",
    "Circle",
    "Contact",
    "ContactSettings",
    "Deformation",
    "Dented",
    "Disturbance",
    "ElectronicsSettings",
    "Face",
    "FaultEvent",
    "Faults",
    "FaultyLine",
    "Finger",
    "Grid",
    "HeldScanning",
    "Inclusion",
    "Layered",
    "Line",
    "LineSettings",
    "Lines",
    "Load",
    "MaterialSettings",
    "MaterialState",
    "Plate",
    "Population",
    "Pose",
    "Press",
    "Probe",
    "SampleTable",
    "ScanClock",
    "Script",
    "ScriptedBend",
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
    "faults_at",
    "indent",
    "line_potentials",
    "make_electronics",
    "make_shard",
    "make_twin",
    "open_twin",
    "pressed",
    "read_settings",
    "reboots",
    "sample_table",
    "solve_contact",
    "strain_of",
    "table_of",
]
