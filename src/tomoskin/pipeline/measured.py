"""One frame as the pipeline takes it, from a board, a session or a file alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, Voltages


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Voltages of one frame.

    Attributes
    ----------
    values
        (n_meas,) V, in the order of the pattern.
    excluded
        (n_meas,) bool: at a rail of the converter, or not finite.
    time, host_time
        s, of the device's clock and of the host's: host times of frames that were read together
        are the same.
    sequence
        The frame's number.
    samples
        What the board sent, where there is a board.
    """

    values: FloatArray
    excluded: NDArray[np.bool_]
    time: float
    host_time: float
    sequence: int = 0
    samples: NDArray[np.uint16] | None = None

    @classmethod
    def of(cls, voltages: Voltages, samples: NDArray[np.uint16], tick_rate: float) -> Self:
        """From a board's frame, whose clock runs at ``tick_rate`` Hz."""
        excluded = voltages.railed | ~np.isfinite(voltages.values)
        time = voltages.ticks / tick_rate
        return cls(voltages.values, excluded, time, voltages.host_time, voltages.sequence, samples)
