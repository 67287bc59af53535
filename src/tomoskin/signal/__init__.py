"""Counts → voltages → differences: an idle skin's noise and drift, and its electrodes' health."""

from tomoskin.signal.baseline import Baseline, BaselineState
from tomoskin.signal.blind import Blind
from tomoskin.signal.difference import (
    DIFFERENCES,
    Consecutive,
    at_one_time,
    difference,
    difference_noise,
    in_phase,
    undone,
)
from tomoskin.signal.health import ElectrodeHealth, Health, Roles, lost_directions
from tomoskin.signal.idle import Idle
from tomoskin.signal.monitor import Monitor
from tomoskin.signal.readout import FIGURES, BoardFigures, Readout
from tomoskin.signal.recording import Recording, frame_times
from tomoskin.signal.reference import Reference

__all__ = [
    "DIFFERENCES",
    "FIGURES",
    "Baseline",
    "BaselineState",
    "Blind",
    "BoardFigures",
    "Consecutive",
    "ElectrodeHealth",
    "Health",
    "Idle",
    "Monitor",
    "Readout",
    "Recording",
    "Reference",
    "Roles",
    "at_one_time",
    "difference",
    "difference_noise",
    "frame_times",
    "in_phase",
    "lost_directions",
    "undone",
]
