"""Single presses of the textile twin, with where they are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Readout
from tomoskin.twin import Press, Scans, TwinSettings

HOLD = 1.0
"""Seconds for which each press has lasted when it is read."""


def labelled_presses(skin: Skin, seed: int, n: int) -> dict[str, NDArray[Any]]:
    """Arrays of an interchange file: ``n`` frames, each of a sheet that nothing pressed before."""
    scans = Scans(skin, TwinSettings.preset("textile", seed))
    readout, sheet = Readout.of(scans.scan, skin.readout), scans.electronics.sheet
    random = np.random.default_rng(seed)
    reach = 0.9 * np.linalg.norm(skin.electrode_centres, axis=1).min()
    turn, far = random.uniform(0, 2 * np.pi, n), reach * np.sqrt(random.random(n))
    xy = far[:, None] * np.c_[np.cos(turn), np.sin(turn)]
    sizes = 0.5e-3 * np.round(random.uniform(16, 40, n))
    forces = random.uniform(1.0, 8.0, n)
    drawn = zip(xy.tolist(), forces.tolist(), sizes.tolist(), strict=True)
    pressed = [[Press(x, y, force, size)] for (x, y), force, size in drawn]
    read = []
    for number, presses in enumerate([*[[]] * 20, *pressed], start=1):
        sheet.renew()
        sheet.set_presses(tuple(presses))
        read.append(readout(scans.frame(number, number * HOLD)).values)
    table = skin.pattern()
    return {
        "voltages": np.array(read[20:]),
        "reference": np.mean(read[:20], axis=0),
        "drive": table.drive,
        "measure": table.measure,
        "xy_m": xy,
    }
