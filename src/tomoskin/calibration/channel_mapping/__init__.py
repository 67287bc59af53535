"""How wires meet electrodes, from a handful of labelled presses."""

from tomoskin.calibration.channel_mapping.solve import SURE, WiringAnswer, solve_wiring
from tomoskin.calibration.channel_mapping.wiring import Wiring, ring_of

__all__ = ["SURE", "Wiring", "WiringAnswer", "ring_of", "solve_wiring"]
