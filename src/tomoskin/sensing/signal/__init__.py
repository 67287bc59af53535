"""Counts → voltages → differences: an idle skin's noise and drift, and its electrodes' health."""

from tomoskin.sensing.signal.baseline import (
    Baseline as Baseline,
    BaselineState as BaselineState,
    Reference as Reference,
    Scatter as Scatter,
)
from tomoskin.sensing.signal.board_diagnosis import (
    STAGES as STAGES,
    CountScale as CountScale,
    diagnose as diagnose,
    meter_steps as meter_steps,
)
from tomoskin.sensing.signal.difference import (
    NuisanceSubspace as NuisanceSubspace,
    difference as difference,
    difference_noise as difference_noise,
    in_phase as in_phase,
    independent as independent,
)
from tomoskin.sensing.signal.evidence import Reciprocity as Reciprocity
from tomoskin.sensing.signal.health import (
    ElectrodeHealth as ElectrodeHealth,
    Health as Health,
    nuisance_directions as nuisance_directions,
)
from tomoskin.sensing.signal.load_ring import LoadRing as LoadRing
from tomoskin.sensing.signal.monitor import Monitor as Monitor
from tomoskin.sensing.signal.readout import (
    FIGURES as FIGURES,
    Headroom as Headroom,
    Readout as Readout,
)
from tomoskin.sensing.signal.recording import Recording as Recording, frame_times as frame_times
