"""Counts → voltages → differences: an idle skin's noise and drift, and its electrodes' health."""

from tomoskin.sensing.signal.baseline import Baseline, BaselineState
from tomoskin.sensing.signal.board_diagnosis import (
    STAGES,
    CountScale,
    diagnose,
    meter_steps,
)
from tomoskin.sensing.signal.difference import (
    Consecutive,
    NuisanceSubspace,
    difference,
    difference_noise,
    in_phase,
    undone,
)
from tomoskin.sensing.signal.evidence import Reciprocity
from tomoskin.sensing.signal.headroom import Headroom
from tomoskin.sensing.signal.health import ElectrodeHealth, Health, nuisance_directions
from tomoskin.sensing.signal.idle import Idle
from tomoskin.sensing.signal.load_ring import LoadRing
from tomoskin.sensing.signal.monitor import Monitor
from tomoskin.sensing.signal.readout import FIGURES, Readout, directions
from tomoskin.sensing.signal.recording import Recording, frame_times
from tomoskin.sensing.signal.reference import Reference, Scatter

__all__ = [
    "FIGURES",
    "STAGES",
    "Baseline",
    "BaselineState",
    "Consecutive",
    "CountScale",
    "ElectrodeHealth",
    "Headroom",
    "Health",
    "Idle",
    "LoadRing",
    "Monitor",
    "NuisanceSubspace",
    "Readout",
    "Reciprocity",
    "Recording",
    "Reference",
    "Scatter",
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
