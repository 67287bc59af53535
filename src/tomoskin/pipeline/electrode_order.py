"""Whether the electrodes of a recording stand in the order of its tables, by an untouched frame.

The frame is compared with the model's voltages, and with what these were if two electrodes were
exchanged, the measuring pairs counted otherwise than the drives, or the values shifted in their
table. What turns or mirrors all electrodes of a round sheet changes nothing in it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.model.pattern import signed
from tomoskin.sensing.signal import Recording

_BEND = 0.1
"""Voltages are compared by logarithms; by themselves below this part of the median."""

_MOST = 3.0
"""A single measurement counts no more than this."""

_APART = 0.3
"""Two orders differ in the measurements that they expect to differ by so much."""

_PART = 0.05
"""Less of the measurements decides nothing."""

_BETTER = 0.6
"""Another order is named that leaves at most this part of the misfit where the two differ."""

_FITS = 0.45
"""Mean misfit of all measurements above which another order is no explanation either."""

_ALL_PAIRS, _NEAR = 16, 3
"""Of more electrodes than the first, only those so near are tried in exchange."""

_TIE = 0.05
"""Orders of another kind that are as good up to this leave open which it is."""


def order_fault(recording: Recording, resistance: FloatArray) -> str | None:
    """What is wrong with the order of the rows, in a sentence; None where nothing shows.

    ``recording`` has its rows as they are in the file; ``resistance`` (n, n) Ω is between the
    electrodes of the untouched skin's model. Nothing is said of files of differences.
    """
    if recording.is_change:
        return None
    n = len(resistance)
    drive = recording.drive if recording.spread else signed(recording.drive, n)
    currents = np.zeros((len(drive), n))
    currents[:, : drive.shape[1]] = drive
    readers = signed(recording.measure, n)
    measured = untouched(recording)
    free = ~((currents != 0.0) & (readers != 0.0)).any(axis=1)
    kept = np.isfinite(measured) & (free if free.mean() > _PART else True)
    model = _voltages(resistance, currents, readers)
    if not (measured[kept].any() and model[kept].any()):
        return None
    sizes = False
    if measured[kept] @ model[kept] < 0.0:
        measured = -measured
    if (measured[kept] >= 0.0).all():  # perhaps sizes, whose signs are not known
        model, sizes = np.abs(model), True
    orders = []
    for kind, name, expected, shift in _orders(resistance, currents, readers, model):
        some = kept & np.roll(kept, shift)
        ratio, rest = _compared(measured, model, np.abs(expected) if sizes else expected, some)
        if rest <= _FITS:
            orders.append((ratio, abs(shift), kind, name))
    if not orders or min(orders)[0] > _BETTER:
        return None
    return _sentence(orders)


def untouched(recording: Recording) -> FloatArray:
    """(n_rows,) its reference, or the mean of its idle frames, real."""
    values = recording.reference
    if values is None:
        values = recording.voltages[: recording.idle].mean(axis=0)
    if np.iscomplexobj(values):
        phase = np.angle(np.nansum(values**2)) / 2.0
        values = (values * np.exp(-1j * phase)).real
    return np.asarray(values, dtype=np.float64)


def _voltages(resistance: FloatArray, currents: FloatArray, readers: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("re,re->r", currents @ resistance, readers))


def _orders(
    resistance: FloatArray, currents: FloatArray, readers: FloatArray, model: FloatArray
) -> Iterator[tuple[str, str, FloatArray, int]]:
    """Kind, words, voltages (n_rows,) and shift of the rows of other orders."""
    n = len(resistance)
    for pair in combinations(range(n), 2):
        if n > _ALL_PAIRS and min(pair[1] - pair[0], n - pair[1] + pair[0]) > _NEAR:
            continue
        turned = np.arange(n)
        turned[list(pair)] = pair[::-1]
        name = f"E{pair[0] + 1} and E{pair[1] + 1} are exchanged"
        yield name, name, _voltages(resistance, currents[:, turned], readers[:, turned]), 0
    for way, kind in ((1, "shifted against"), (-1, "counted the other way round than")):
        for by in range(n):
            turned = (way * np.arange(n) + by + (way > 0)) % n
            if (turned != np.arange(n)).any():
                expected = _voltages(resistance, currents, readers[:, turned])
                yield kind, f"the measuring electrodes are {kind} the driven ones", expected, 0
    for shift in range(-n, n + 1):
        if shift:
            name = f"the values are shifted by {abs(shift)} rows of the tables"
            yield "values", name, np.roll(model, shift), shift


def _compared(
    measured: FloatArray, model: FloatArray, other: FloatArray, kept: NDArray[np.bool_]
) -> tuple[float, float]:
    """Misfit of the other order over that of the own, where they differ; its mean of all rows."""
    (data, own, new) = (_bent(values[kept]) for values in (measured, model, other))
    apart = np.abs(own - new) > _APART
    if apart.sum() < max(_PART * len(data), 6):
        return np.inf, np.inf
    rest = np.minimum(np.abs(data - new), _MOST)
    before = np.minimum(np.abs(data - own)[apart], _MOST).mean()
    return float(rest[apart].mean() / max(before, 1e-9)), float(rest.mean())


def _bent(values: FloatArray) -> FloatArray:
    return np.asarray(np.arcsinh(values / (_BEND * np.median(np.abs(values)) + 1e-300)))


def _sentence(orders: list[tuple[float, int, str, str]]) -> str:
    """The best order, the smallest shift of those that are as good; or that it is left open."""
    best = min(orders)[0] + _TIE
    likely = sorted(((shift, kind, name) for ratio, shift, kind, name in orders if ratio <= best))
    if len({kind for _, kind, _ in likely}) > 1:
        return (
            "its rows do not stand in the order of its tables: electrodes, or values, are shifted"
        )
    return f"its untouched frame looks as if {likely[0][2]}"
