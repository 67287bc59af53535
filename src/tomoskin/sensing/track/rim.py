"""Touches that are told lie on the sheet."""

from __future__ import annotations

from dataclasses import replace

from tomoskin.core import Touch
from tomoskin.model.mesh import Outline


def on_sheet(touch: Touch, outline: Outline | None) -> Touch:
    """``touch``, or where it is off the sheet the same at the nearest point of its rim.

    Its covariance stays: it says how well the position is known, and who draws its ellipse cuts it
    at the rim.
    """
    place = [[touch.detection.x, touch.detection.y]]
    if outline is None or outline.contains(place)[0]:
        return touch
    ((x, y),) = outline.point(outline.nearest(place)).tolist()
    return replace(touch, detection=replace(touch.detection, x=x, y=y))
