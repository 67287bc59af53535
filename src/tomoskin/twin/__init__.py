"""A skin without hardware: probes → dents → conductivity → potentials → counts → bytes."""

from tomoskin.twin.bend import (
    BendSettings as BendSettings,
    Bent as Bent,
    Deformation as Deformation,
    Pose as Pose,
    Stretched as Stretched,
)
from tomoskin.twin.circuit import (
    ElectronicsSettings as ElectronicsSettings,
    ThermalVoltages as ThermalVoltages,
)
from tomoskin.twin.contact import (
    ContactSettings as ContactSettings,
    Grid as Grid,
    solve_contact as solve_contact,
)
from tomoskin.twin.course import (
    Disturbance as Disturbance,
    bent as bent,
    bent_truth as bent_truth,
    disturbed as disturbed,
    pressed as pressed,
    reboots as reboots,
)
from tomoskin.twin.faults import Faults as Faults, Line as Line, LineSettings as LineSettings
from tomoskin.twin.held_scanning import (
    Board as Board,
    HeldScanning as HeldScanning,
    Question as Question,
    Setting as Setting,
)
from tomoskin.twin.material import MaterialSettings as MaterialSettings
from tomoskin.twin.presets import PRESETS as PRESETS, TwinSettings as TwinSettings
from tomoskin.twin.probe import (
    FACES as FACES,
    Circle as Circle,
    Face as Face,
    Finger as Finger,
    Press as Press,
    Probe as Probe,
    Shape as Shape,
    Square as Square,
)
from tomoskin.twin.scanning import (
    SampleTable as SampleTable,
    ScanClock as ScanClock,
    chopped_table as chopped_table,
    sample_table as sample_table,
    table_of as table_of,
)
from tomoskin.twin.script import (
    Script as Script,
    check_script as check_script,
    check_settling as check_settling,
)
from tomoskin.twin.script_schema import FORMAT as FORMAT, SECTIONS as SECTIONS
from tomoskin.twin.sheet import TwinSkin as TwinSkin
from tomoskin.twin.source import (
    Scans as Scans,
    SheetTransport as SheetTransport,
    TwinTransport as TwinTransport,
    make_electronics as make_electronics,
    make_twin as make_twin,
    on_converter as on_converter,
    read_board as read_board,
    read_settings as read_settings,
)
from tomoskin.twin.stepped import SteppedSkin as SteppedSkin
