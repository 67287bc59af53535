"""The board on a ring of known resistors: the potential of each channel under each drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.signal.readout import FIGURES

_DROP = 0.1
"""V across one resistor at the board's current: 3.5 V behind a gain of 35."""

_LEAK = 1e-8
"""S from each node to ground: what floats has a potential all the same."""


@dataclass(frozen=True, eq=False)
class LoadRing:
    """Resistors between neighbouring terminals; ``ohms`` (n,): number k joins k and k + 1.

    Two of them differ from the others, so that no exchange of terminals looks the same.
    """

    ohms: FloatArray

    @classmethod
    def for_current(cls, channels: int, current: float) -> Self:
        """Of one stock value, 1 Ω at 100 mA: two in parallel at first, then three, else one."""
        ohms = np.full(channels, _DROP / current)
        ohms[:2] /= (2.0, 3.0)
        return cls(ohms)

    @property
    def conductance(self) -> FloatArray:
        """(n, n) S, the ring's admittance matrix; resistors of infinite ohms are left out."""
        n = len(self.ohms)
        here = np.arange(n)
        there = (here + 1) % n
        matrix = np.zeros((n, n))
        np.add.at(matrix, (here, here), 1 / self.ohms)
        np.add.at(matrix, (there, there), 1 / self.ohms)
        np.add.at(matrix, (here, there), -1 / self.ohms)
        np.add.at(matrix, (there, here), -1 / self.ohms)
        return matrix

    @property
    def resistance(self) -> FloatArray:
        """(n, n) Ω, transfer resistance against the terminals' mean."""
        return np.asarray(np.linalg.pinv(self.conductance), dtype=np.float64)

    def scans(self) -> tuple[Scan, Scan]:
        """Neighbours one way, then the other; every channel sampled under each drive."""
        n = len(self.ohms)
        pairs = [(e, (e + 1) % n) for e in range(n)]
        ways = ([(k, (k + 1) % n) for k in range(n)], [((k + 1) % n, k) for k in range(n)])
        return tuple(
            Scan.of(Pattern.from_pairs(n, way, pairs, include_driven=True)) for way in ways
        )  # type: ignore[return-value]


@dataclass(frozen=True)
class ChannelFaults:
    """What differs from a sound board.

    ``source``, ``sink``, ``reading``: the channel that is connected to the current or to ground, or
    that is read, instead of another; None: none is. ``high``, ``low``: a channel whose transistor
    always conducts.
    """

    source: Mapping[int, int | None] = field(default_factory=dict)
    sink: Mapping[int, int | None] = field(default_factory=dict)
    reading: Mapping[int, int] = field(default_factory=dict)
    high: int | None = None
    low: int | None = None


def potentials(
    ring: LoadRing, drives: IntArray, current: float, faults: ChannelFaults | None = None
) -> FloatArray:
    """Potential of each channel against ground, V.

    Parameters
    ----------
    drives
        (n_drives, 2) source, sink.
    current
        A; less where the load takes more than the source's compliance.
    faults
        Without it, none.

    Returns (n_drives, n).
    """
    faults = faults or ChannelFaults()
    n = len(ring.ohms)
    switch = 1 / FIGURES.switch_resistance
    matrix = np.zeros((len(drives), n + 1, n + 1))
    matrix[:, :n, :n] = ring.conductance
    matrix[:, range(n + 1), range(n + 1)] += _LEAK
    for one, (source, sink) in zip(matrix, drives.tolist(), strict=True):
        for e in {faults.source.get(source, source), faults.high} - {None}:
            one[np.ix_((e, n), (e, n))] += switch * np.array([[1, -1], [-1, 1]])
        for e in {faults.sink.get(sink, sink), faults.low} - {None}:
            one[e, e] += switch
    bus = np.zeros((len(drives), n + 1, 1))
    bus[:, n] = current
    volts = np.asarray(np.linalg.solve(matrix, bus)[..., 0], dtype=np.float64)
    volts *= np.minimum(1, FIGURES.compliance / volts[:, n:])
    return volts[:, [faults.reading.get(e, e) for e in range(n)]]
