"""Frames of a finger that rubs a skin."""

from __future__ import annotations

import numpy as np

from tomoskin import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin

SKIN = "textile-disc-8"
PATTERN = Pattern.adjacent(8)


def rubbed_with_a_lag(lag):
    """Changes (n, n_meas) of a finger that goes to and fro at 60 mm/s, whose response lies ``lag``
    m behind it, and s."""
    rng, skin = np.random.default_rng(6), Skin.load(SKIN).altered({"mesh": {"cells": 800}})
    angle = 2.4 * np.arange(24) + rng.uniform(-0.3, 0.3, 24)
    corners = rng.uniform(0.03, 0.085, (24, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    legs = np.diff(corners, axis=0)
    length = np.linalg.norm(legs, axis=1)
    steps = [np.arange(0, way, 0.003)[:, None] for way in length]
    units = legs / length[:, None]
    seen = np.vstack(
        [a + (s - lag) * u for a, s, u in zip(corners[:-1], steps, units, strict=True)]
    )
    away = ((seen[:, None] - skin.mesh().centroids) ** 2).sum(axis=2)
    model = ForwardModel(skin.mesh(), PATTERN, contact_impedance=skin.contact_impedance)
    dv = -np.exp(-0.5 * away / 0.012**2) @ model.jacobian(skin.conductivity).T
    return dv + 0.01 * np.median(np.abs(dv)) * rng.normal(size=dv.shape), 0.05 * np.arange(len(dv))
