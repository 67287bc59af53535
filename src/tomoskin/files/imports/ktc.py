"""Kuopio Tomography Challenge 2023: current patterns and measuring pairs as matrices.

The challenge's own .mat files hold ``Inj`` (n_el, n_inj), ``Mpat`` (n_el, n_pairs) and ``Uel``;
collected sets hold ``inj``, ``mpat``, ``U`` (n, n_inj · n_pairs) and ``U_ref``. Values run
injection by injection. Electrode 1 is at the top and they are counted counter-clockwise
(fitted, not from the authors); the recording counts them clockwise, as built-in skins do.
The injected currents differ by some per cent; the voltages are left as they are.
"""

from __future__ import annotations

import numpy as np

from tomoskin.core import Arrays, DataError, real_numbers
from tomoskin.files.imports.tables import clockwise, pairs_of, voltages_of, without_repeats
from tomoskin.sensing.signal import Recording

_NAMES = (("inj", "mpat", "U", "U_ref"), ("Inj", "Mpat", "Uel", "Uelref"))


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
    injections = pairs_of(real_numbers(arrays, inj, source).T, "injection", source)
    pairs = pairs_of(real_numbers(arrays, mpat, source).T, "measuring pair", source)
    n_electrodes = arrays[inj].shape[0]
    n_rows = len(injections) * len(pairs)
    values = real_numbers(arrays, voltages, source).reshape(-1)
    if not values.size or values.size % n_rows:
        raise DataError(
            f"expected {voltages} of (n, {n_rows}), got {arrays[voltages].shape}", where=source
        )
    frames = values.reshape(-1, n_rows)
    water = None
    if reference in arrays:
        water = real_numbers(arrays, reference, source).reshape(-1)
        if len(water) != n_rows:
            raise DataError(f"expected {reference} ({n_rows},), got {len(water)}", where=source)
    drive = clockwise(np.repeat(injections, len(pairs), axis=0), n_electrodes)
    measure = clockwise(np.tile(pairs, (len(injections), 1)), n_electrodes)
    return without_repeats(voltages_of(source, frames, (drive, measure), reference=water))
