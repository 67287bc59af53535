"""Tanks of Kuopio: current patterns and measuring pairs as matrices.

The 2023 challenge's own .mat files hold ``Inj`` (n_el, n_inj), ``Mpat`` (n_el, n_pairs), ``Uel``;
collected sets hold ``inj``, ``mpat``, ``U`` (n, n_inj · n_pairs) and ``U_ref``. The older KIT4
tank's hold ``CurrentPattern``, ``MeasPattern``, ``Uel`` (n_pairs, n_inj), one or several, and
``water``. Values run injection by injection. Electrode 1 is at the top; the challenge counts
counter-clockwise, KIT4 clockwise (both fitted to the targets, not from the authors). The recording
counts clockwise, as built-in skins do.
The injected currents differ by some per cent; the voltages are left as they are.
"""

from __future__ import annotations

import numpy as np

from tomoskin.core import Arrays, DataError, FloatArray, real_numbers
from tomoskin.files.imports.tables import clockwise, drives_of, pairs_of, voltages_of
from tomoskin.sensing.signal import Recording

_NAMES = (
    ("inj", "mpat", "U", "U_ref"),
    ("Inj", "Mpat", "Uel", "Uelref"),
    ("CurrentPattern", "MeasPattern", "Uel", "water"),
)


def detects(arrays: Arrays) -> bool:
    """Whether the keys are those of the challenge."""
    return any(set(arrays) >= set(names[:3]) for names in _NAMES)


def parse(arrays: Arrays, source: str) -> Recording:
    """Return the recording, with the water's voltages as its reference where they are there.

    Raises
    ------
    DataError
        When the shapes do not belong together or a pattern is no pair.
    """
    inj, mpat, voltages, reference = next(n for n in _NAMES if set(arrays) >= set(n[:3]))
    injections = drives_of(real_numbers(arrays, inj, source).T, "injection", source)
    pairs = pairs_of(real_numbers(arrays, mpat, source).T, "measuring pair", source)
    n_electrodes = arrays[inj].shape[0]
    n_rows = len(injections) * len(pairs)
    values = _flat(real_numbers(arrays, voltages, source), len(injections), len(pairs))
    if not values.size or values.size % n_rows:
        raise DataError(
            f"expected {voltages} of (n, {n_rows}), got {arrays[voltages].shape}", where=source
        )
    frames = values.reshape(-1, n_rows)
    water = None
    if reference in arrays:
        water = _flat(real_numbers(arrays, reference, source), len(injections), len(pairs))
        if len(water) != n_rows:
            raise DataError(f"expected {reference} ({n_rows},), got {len(water)}", where=source)
    rows = np.repeat(injections, len(pairs), axis=0), np.tile(pairs, (len(injections), 1))
    if inj != "CurrentPattern":
        turned = clockwise(rows[0], n_electrodes)
        if rows[0].shape[1] > 2:
            turned = rows[0][:, clockwise(np.arange(n_electrodes), n_electrodes)]
        rows = turned, clockwise(rows[1], n_electrodes)
    return voltages_of(source, frames, rows, reference=water).without_repeats()


def _flat(values: FloatArray, n_injections: int, n_pairs: int) -> FloatArray:
    """Values one after another, injection by injection."""
    if values.ndim > 1 and values.shape[-2:] == (n_pairs, n_injections) and n_pairs > 1:
        values = np.swapaxes(values, -2, -1)
    return values.reshape(-1)
