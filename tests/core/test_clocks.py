"""Two clocks are compared while nothing comes between."""

from __future__ import annotations

import pytest

from tomoskin.core import clock_ahead


class Machine:
    """Its clocks differ by ``apart`` s; ``pauses`` holds what stops it before each read."""

    def __init__(self, apart: float, pauses: list[float]) -> None:
        self.now, self.apart, self.pauses = 100.0, apart, iter(pauses)

    def own(self) -> float:
        self.now += next(self.pauses, 1e-6)
        return self.now

    def other(self) -> float:
        return self.own() + self.apart


@pytest.mark.parametrize("stopped", range(6))
def test_a_pause_between_two_reads_does_not_count(stopped: int) -> None:
    pauses = [1e-6] * stopped + [0.03]
    machine = Machine(7.0, pauses)
    assert clock_ahead(machine.other, machine.own) == pytest.approx(7.0, abs=2e-6)
