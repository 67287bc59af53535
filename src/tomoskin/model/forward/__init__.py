"""The complete electrode model: from conductivity to voltages and their derivatives."""

from tomoskin.model.forward.differentiable import jax_voltages, torch_voltages
from tomoskin.model.forward.engine import Engine
from tomoskin.model.forward.engine_choice import choose_engine
from tomoskin.model.forward.model import ForwardModel, State, Terminals
from tomoskin.model.forward.solution import Solution

__all__ = [
    "Engine",
    "ForwardModel",
    "Solution",
    "State",
    "Terminals",
    "choose_engine",
    "jax_voltages",
    "torch_voltages",
]
