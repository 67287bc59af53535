"""How wires meet electrodes, from a handful of labelled presses."""

from tomoskin.touch.wiring.solve import SURE, WiringAnswer, solve_wiring
from tomoskin.touch.wiring.wiring import Wiring, ring_of

__all__ = ["SURE", "Wiring", "WiringAnswer", "ring_of", "solve_wiring"]
