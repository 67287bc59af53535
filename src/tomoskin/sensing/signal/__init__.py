"""Counts → voltages → differences: an idle skin's noise and drift, and its electrodes' health."""

from tomoskin.sensing.signal.baseline import Baseline, BaselineState, Reference, Scatter
from tomoskin.sensing.signal.board_diagnosis import (
    STAGES,
    CountScale,
    diagnose,
    meter_steps,
)
from tomoskin.sensing.signal.difference import (
    NuisanceSubspace,
    difference,
    difference_noise,
    in_phase,
)
from tomoskin.sensing.signal.evidence import Reciprocity
from tomoskin.sensing.signal.headroom import Headroom
from tomoskin.sensing.signal.health import ElectrodeHealth, Health, nuisance_directions
from tomoskin.sensing.signal.load_ring import LoadRing
from tomoskin.sensing.signal.monitor import Monitor
from tomoskin.sensing.signal.readout import FIGURES, Readout
from tomoskin.sensing.signal.recording import Recording, frame_times

__all__ = [
    "FIGURES",
    "STAGES",
    "Baseline",
    "BaselineState",
    "CountScale",
    "ElectrodeHealth",
    "Headroom",
    "Health",
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
    "frame_times",
    "in_phase",
    "meter_steps",
    "nuisance_directions",
]
