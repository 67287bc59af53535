"""Counts → voltages → differences: an idle skin's noise and drift, and its electrodes' health."""

from tomoskin.sensing.signal.baseline import Baseline, BaselineState
from tomoskin.sensing.signal.board_diagnosis import CountScale, Diagnosis, diagnose
from tomoskin.sensing.signal.difference import (
    DIFFERENCES,
    Consecutive,
    at_one_time,
    difference,
    difference_noise,
    in_phase,
    undone,
)
from tomoskin.sensing.signal.evidence import Reciprocity
from tomoskin.sensing.signal.headroom import Headroom
from tomoskin.sensing.signal.health import ElectrodeHealth, Health, Roles, nuisance_directions
from tomoskin.sensing.signal.idle import Idle
from tomoskin.sensing.signal.load_ring import LoadRing
from tomoskin.sensing.signal.monitor import Monitor
from tomoskin.sensing.signal.nuisance import NuisanceSubspace
from tomoskin.sensing.signal.power_up import STAGES, MeterStep, meter_steps
from tomoskin.sensing.signal.readout import FIGURES, Readout, directions
from tomoskin.sensing.signal.recording import Recording, frame_times, time_notes
from tomoskin.sensing.signal.reference import Reference
from tomoskin.sensing.signal.scatter import Scatter

__all__ = [
    "DIFFERENCES",
    "FIGURES",
    "STAGES",
    "Baseline",
    "BaselineState",
    "Consecutive",
    "CountScale",
    "Diagnosis",
    "ElectrodeHealth",
    "Headroom",
    "Health",
    "Idle",
    "LoadRing",
    "MeterStep",
    "Monitor",
    "NuisanceSubspace",
    "Readout",
    "Reciprocity",
    "Recording",
    "Reference",
    "Roles",
    "Scatter",
    "at_one_time",
    "diagnose",
    "difference",
    "difference_noise",
    "directions",
    "frame_times",
    "in_phase",
    "meter_steps",
    "nuisance_directions",
    "time_notes",
    "undone",
]
