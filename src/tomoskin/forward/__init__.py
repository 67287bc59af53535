"""The complete electrode model: from conductivity to voltages and their derivatives."""

from tomoskin.forward.engine import Engine
from tomoskin.forward.engine_choice import choose_engine
from tomoskin.forward.model import ForwardModel, State
from tomoskin.forward.solution import Solution
from tomoskin.forward.terminals import Terminals

__all__ = ["Engine", "ForwardModel", "Solution", "State", "Terminals", "choose_engine"]
