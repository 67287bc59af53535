"""A disc with point electrodes, whose voltages are known in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.signal import Monitor, Reference

N = 16
NOISE = 2e-3


@dataclass(frozen=True)
class Disc:
    """Adjacent pattern on a uniform disc: the potential of a rim source is −ln|x − y|/π."""

    pattern: Pattern
    scan: Scan

    def potentials(self, squeeze: float = 0.0) -> np.ndarray:
        """(n_samples,) V; ``squeeze`` moves an electrode along the rim, as a press would."""
        turn = 2 * np.pi * np.arange(N) / N
        turn[5] += squeeze
        place = np.exp(1j * turn)
        apart = np.abs(place[:, None] - place)
        np.fill_diagonal(apart, 0.05)
        green = -np.log(apart) / np.pi
        field = green[self.scan.drives[:, 0]] - green[self.scan.drives[:, 1]]
        return field[self.scan.sample_drive, self.scan.sample_electrode]

    def rows(self, potentials: np.ndarray) -> np.ndarray:
        """(n_meas,) V."""
        return potentials[self.scan.plus] - potentials[self.scan.minus]


class Watched:
    """A monitor that is fed samples in V, with noise of their own."""

    def __init__(self, disc: Disc, seed: int = 0) -> None:
        self.disc, self.random = disc, np.random.default_rng(seed)
        idle = np.array([disc.rows(self.noisy(disc.potentials())) for _ in range(40)])
        model = disc.rows(disc.potentials())
        none = np.zeros(disc.pattern.n_meas, bool)
        self.monitor = Monitor(
            disc.pattern, Reference.of(idle), model, unusable=none, scan=disc.scan
        )
        self.frames = 0

    def noisy(self, potentials: np.ndarray) -> np.ndarray:
        return potentials + NOISE / np.sqrt(2) * self.random.standard_normal(len(potentials))

    def push(self, potentials: np.ndarray, rail: float = np.inf):
        """Health of a frame of these potentials; those at ``rail`` are railed."""
        scan = self.disc.scan
        at_rail = potentials >= rail
        noisy = np.where(at_rail, rail, self.noisy(potentials))
        counts = np.round(20000 + 5000 * np.clip(noisy, -3.9, 9)).astype(np.uint16)
        self.frames += 1
        railed = at_rail[scan.plus] | at_rail[scan.minus]
        return self.monitor.push(self.disc.rows(noisy), railed, 0.1 * self.frames, counts)


@pytest.fixture(scope="session")
def disc() -> Disc:
    pattern = Pattern.adjacent(N)
    return Disc(pattern, Scan.of(pattern))


@pytest.fixture
def watched(disc: Disc) -> Watched:
    return Watched(disc)


@pytest.fixture
def watch() -> type[Watched]:
    """For a test that makes its own."""
    return Watched
