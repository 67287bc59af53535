"""Counts → voltages → differences: an idle skin's noise and drift, and its electrodes' health."""

from tomoskin.signal.baseline import Baseline, BaselineState
from tomoskin.signal.blind import Blind
from tomoskin.signal.board import FIGURES, BoardFigures
from tomoskin.signal.consecutive import Consecutive, at_one_time
from tomoskin.signal.difference import DIFFERENCES, difference, difference_noise, undone
from tomoskin.signal.health import ElectrodeHealth, Health
from tomoskin.signal.idle import Idle
from tomoskin.signal.monitor import Monitor
from tomoskin.signal.phase import in_phase
from tomoskin.signal.readout import Readout
from tomoskin.signal.recording import Recording, frame_times
from tomoskin.signal.reference import Reference
from tomoskin.signal.roles import Roles, lost_directions

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
