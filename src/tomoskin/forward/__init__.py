"""The complete electrode model: from conductivity to voltages and their derivatives."""

from tomoskin.forward.engine import Engine, choose_engine
from tomoskin.forward.model import ForwardModel
from tomoskin.forward.solution import Solution
from tomoskin.forward.state import State

__all__ = ["Engine", "ForwardModel", "Solution", "State", "choose_engine"]
