"""Frames of the twin as bends over a strip change them."""

from __future__ import annotations

import numpy as np

from tomoskin.model.mesh import Hinge
from tomoskin.pipeline import voltage_covariance
from tomoskin.twin import Bent, TwinSettings, TwinSkin


def frames_bent(prepared, angles, width, seed):
    """(n, n_meas) V: what bends by ``angles`` (n,) rad over ``width`` m do to the twin, with the
    noise of its board."""
    sheet = TwinSkin.of(prepared.skin, TwinSettings.preset("ideal"))
    seen = {}
    for angle in np.unique(angles):
        sheet.set_pose((Bent(Hinge(float(angle), width)),))
        seen[angle] = sheet.model.solve(sheet.conductivity()).voltages
    covariance = voltage_covariance(prepared, None)
    noise = np.random.default_rng(seed).multivariate_normal(
        np.zeros(len(covariance)), covariance, len(angles)
    )
    return np.array([seen[angle] - seen[0.0] for angle in angles]) + noise
