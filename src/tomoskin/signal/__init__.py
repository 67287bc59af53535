"""Counts → voltages → differences: an idle skin's noise and drift, and its electrodes' health."""

from typing import Any

from tomoskin._moved import moved
from tomoskin.signal.baseline import Baseline, BaselineState
from tomoskin.signal.board_diagnosis import CountScale, Diagnosis, diagnose
from tomoskin.signal.difference import (
    DIFFERENCES,
    Consecutive,
    at_one_time,
    difference,
    difference_noise,
    in_phase,
    undone,
)
from tomoskin.signal.evidence import Reciprocity
from tomoskin.signal.headroom import Headroom
from tomoskin.signal.health import ElectrodeHealth, Health, Roles, nuisance_directions
from tomoskin.signal.idle import Idle
from tomoskin.signal.load_ring import LoadRing
from tomoskin.signal.monitor import Monitor
from tomoskin.signal.nuisance import NuisanceSubspace
from tomoskin.signal.power_up import STAGES, MeterStep, meter_steps
from tomoskin.signal.readout import FIGURES, BoardFigures, Readout, directions
from tomoskin.signal.recording import Recording, frame_times
from tomoskin.signal.reference import Reference
from tomoskin.signal.scatter import Scatter

__all__ = [
    "DIFFERENCES",
    "FIGURES",
    "STAGES",
    "Baseline",
    "BaselineState",
    "BoardFigures",
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
    "undone",
]


def __getattr__(name: str) -> Any:
    return moved("signal", name)
