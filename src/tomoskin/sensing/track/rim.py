"""Touches that are told lie on the sheet."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tomoskin.core import Touch
from tomoskin.model.mesh import Outline

_PARTS = 720
"""Of the rim, at whose ends its distance from the middle is taken."""


@dataclass(frozen=True)
class Rim:
    """Where a sheet ends.

    ``inner``: m from its ``centre``, within which each place is on it: nearly all touches are
    there, and nothing else is asked for them.
    """

    outline: Outline
    centre: tuple[float, float]
    inner: float

    @classmethod
    def of(cls, outline: Outline) -> Self:
        """Of a sheet with that outline."""
        x, y = map(float, outline.centre)
        if not outline.contains([[x, y]])[0]:
            return cls(outline, (x, y), 0.0)
        step = outline.length / _PARTS
        far = np.linalg.norm(outline.polyline(step) - (x, y), axis=1)
        return cls(outline, (x, y), max(float(far.min()) - step, 0.0))

    def on_sheet(self, touch: Touch) -> Touch:
        """``touch``, or where it is off the sheet the same at the nearest point of the rim.

        Its covariance stays: it says how well the position is known, and who draws its ellipse
        cuts it at the rim.
        """
        detection = touch.detection
        away = math.hypot(detection.x - self.centre[0], detection.y - self.centre[1])
        place = [[detection.x, detection.y]]
        if away < self.inner or self.outline.contains(place)[0]:
            return touch
        ((x, y),) = self.outline.point(self.outline.nearest(place)).tolist()
        return replace(touch, detection=replace(detection, x=x, y=y))
