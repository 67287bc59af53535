"""The board on a ring of known resistors: what channels read, and what single faults change."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

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
    def for_current(cls, channels: int, current: float, drop: float = _DROP) -> Self:
        """Of one stock value, 1 Ω at 100 mA: two in parallel at first, then three, else one.

        ``drop`` is the V between neighbours, as the board's record has it.
        """
        ohms = np.full(channels, drop / current)
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


SOUND = ChannelFaults()
"""No channel differs."""


def potentials(
    ring: LoadRing, drives: IntArray, current: float, faults: ChannelFaults = SOUND
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


_BANK = 8
"""Channels behind one demultiplexer."""

_BITS = 3
_WRONG = (1e-3, 0.1, 0.22, 0.47, 2.1, 4.7, 10.0, np.inf)
"""Resistors over their nominal values: shorted, of another value, open."""


@dataclass(frozen=True, eq=False)
class BoardFault:
    """One thing that may be wrong.

    Attributes
    ----------
    text
        What is wrong and where to look, with the parts' names on the board.
    volts
        (n_drives, n) potentials that it would give at the nominal current, V.
    unknown
        (n_drives, n) readings that it leaves open: of what floats.
    """

    text: str
    volts: FloatArray
    unknown: NDArray[np.bool_]


def single_faults(ring: LoadRing, drives: IntArray, current: float) -> Iterator[BoardFault]:
    """Every fault that is looked for, on ``ring``, whose ``drives`` (n_drives, 2) are scanned."""

    def fault(text: str, ring: LoadRing = ring, **faults: Any) -> BoardFault:
        volts = potentials(ring, drives, current, ChannelFaults(**faults))
        return BoardFault(text, volts, np.zeros(volts.shape, bool))

    n = len(ring.ohms)
    yield replace(
        nothing := fault("no current flows: +12V, R23, Q21, U22, or both jumpers are open"),
        volts=np.zeros_like(nothing.volts),
    )
    for e in range(n):
        yield from _of_a_channel(e, fault)
        yield _open_terminal(e, ring, drives, current)
        yield from _of_a_resistor(e, ring, fault)
    for a, b in combinations(range(n), 2):
        yield from _exchanged(a, b, fault)
    yield from _of_address_lines(n, fault)


Make = Callable[..., BoardFault]


def _of_a_channel(e: int, fault: Make) -> Iterator[BoardFault]:
    name, part = f"E{e + 1}", 100 * (e + 1)
    high, shift, low = f"Q{part + 2}", f"Q{part + 1}", f"Q{part + 3}"
    yield fault(f"{name} is never connected to the current: {high}, {shift}", source={e: None})
    yield fault(f"{name} is never connected to ground: {low}, R{part + 4}", sink={e: None})
    yield fault(f"{name} is always connected to the current: {high} is shorted, or {shift}", high=e)
    yield fault(f"{name} is always connected to ground: {low} is shorted", low=e)


def _open_terminal(e: int, ring: LoadRing, drives: IntArray, current: float) -> BoardFault:
    ohms = ring.ohms.copy()
    ohms[[e - 1, e]] = np.inf
    volts = potentials(LoadRing(ohms), drives, current)
    unknown = np.zeros(volts.shape, bool)
    unknown[:, e] = ~(drives == e).any(axis=1)
    text = f"E{e + 1} touches nothing: the resistors' wire, its terminal J{100 * (e + 1) + 1}"
    return BoardFault(text, volts, unknown)


def _of_a_resistor(e: int, ring: LoadRing, fault: Make) -> Iterator[BoardFault]:
    between = f"E{e + 1} and E{(e + 1) % len(ring.ohms) + 1}"
    for times in _WRONG:
        ohms = ring.ohms.copy()
        ohms[e] *= times
        said = {1e-3: "shorted", np.inf: "open"}.get(times, f"about {ohms[e]:.2g} Ω")
        yield fault(
            f"the resistor between {between} is {said}, not {ring.ohms[e]:.3g} Ω", LoadRing(ohms)
        )


def _exchanged(a: int, b: int, fault: Make) -> Iterator[BoardFault]:
    both, swap = f"E{a + 1} and E{b + 1}", {a: b, b: a}
    yield fault(f"the wires of {both} are exchanged", source=swap, sink=swap, reading=swap)
    yield fault(f"the readings of {both} are exchanged: headers J62, J63", reading=swap)
    yield fault(f"the sources {both} are exchanged: U81, U91", source=swap)
    yield fault(f"the sinks {both} are exchanged: U82, U92", sink=swap)


def _of_address_lines(n: int, fault: Make) -> Iterator[BoardFault]:
    for side, chip in (("source", "U81, U91"), ("sink", "U82, U92")):
        for bit in range(_BITS):
            for level in (0, 1):
                map_ = {e: e & ~(1 << bit) | level << bit for e in range(n)}
                yield fault(
                    f"address line {bit} of the {side}s is always {'high' if level else 'low'}: "
                    f"header J64, {chip}",
                    **{side: map_},
                )
        for one, other in combinations(range(_BITS), 2):
            yield fault(
                f"address lines {one} and {other} of the {side}s are exchanged: header J64, {chip}",
                **{side: {e: _exchange_bits(e, one, other) for e in range(n)}},
            )
        for bank in range(0, n, _BANK):
            dead: dict[int, int | None] = dict.fromkeys(range(bank, bank + _BANK))
            yield fault(
                f"no {side} of E{bank + 1} to E{bank + _BANK} is ever enabled: header J64, {chip}",
                **{side: dead},
            )


def _exchange_bits(e: int, one: int, other: int) -> int:
    differ = (e >> one ^ e >> other) & 1
    return e ^ (differ << one | differ << other)
