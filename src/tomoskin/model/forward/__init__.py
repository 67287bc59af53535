"""The complete electrode model: from conductivity to voltages and their derivatives."""

from tomoskin.model.forward.batch import TouchBatch as TouchBatch
from tomoskin.model.forward.differentiable import (
    jax_voltages as jax_voltages,
    torch_voltages as torch_voltages,
)
from tomoskin.model.forward.engine_choice import choose_engine as choose_engine
from tomoskin.model.forward.model import (
    ForwardModel as ForwardModel,
    State as State,
    Terminals as Terminals,
)
