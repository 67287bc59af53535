"""Values of a skin file → outline, surface and electrodes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tomoskin.core import DIMENSIONS, FloatArray, GeometryError
from tomoskin.mesh import (
    Arm,
    Cap,
    Cylinder,
    Disc,
    Draped,
    ElectrodeArc,
    Ellipse,
    Outline,
    Plane,
    Polygon,
    Rectangle,
    Saddle,
    Surface,
)

OFF_RIM = 0.01
"""A position may miss the rim by half an electrode, and by this part of the rim's length."""


def outline_of(values: Mapping[str, Any]) -> Outline:
    """Outline of the section ``[outline]``."""
    match values["shape"]:
        case "disc":
            return Disc(values["diameter"] / 2)
        case "ellipse":
            return Ellipse(values["width"] / 2, values["height"] / 2)
        case "rectangle":
            return Rectangle(values["width"], values["height"])
        case _:
            return Polygon(np.array(values["vertices"]))


def surface_of(values: Mapping[str, Any], folder: Path) -> Surface:
    """What the section ``[surface]`` says that the sheet lies on; files are in ``folder``."""
    match values["shape"]:
        case "cylinder":
            return Cylinder(values["radius"], values["axis"])
        case "cap":
            return Cap(values["radius"])
        case "saddle":
            return Saddle(values["radius_x"], values["radius_y"])
        case "arm":
            return Arm(values["radius"], values["bend"], values["joint"])
        case "file":
            scale = DIMENSIONS["length"][values["unit"]]
            return Draped.read(folder / values["file"], scale=scale)
        case _:
            return Plane()


def arcs_of(outline: Outline, values: Mapping[str, Any]) -> tuple[ElectrodeArc, ...]:
    """Electrodes of the section ``[electrodes]``, E1 first.

    Raises GeometryError that names the electrode whose position is off the rim.
    """
    if "positions" in values:
        centres = _placed(outline, np.array(values["positions"]), values["width"])
    else:
        step = outline.length / values["count"]
        turn = -1 if values["order"] == "clockwise" else 1
        centres = outline.toward(values["first"]) + turn * step * np.arange(values["count"])
    return tuple(ElectrodeArc.around(float(s) % outline.length, values["width"]) for s in centres)


def _placed(outline: Outline, positions: FloatArray, width: float) -> FloatArray:
    s = outline.nearest(positions)
    gap = np.linalg.norm(outline.point(s) - positions, axis=1)
    allowed = min(width / 2, OFF_RIM * outline.length)
    if (gap > allowed).any():
        number = int(np.argmax(gap > allowed))
        x, y = positions[number] * 1e3
        raise GeometryError(
            f"expected a position on the rim within {allowed * 1e3:.3g} mm, "
            f"got ({x:.4g}, {y:.4g}) mm, {gap[number] * 1e3:.3g} mm off",
            where=f"electrode {number} (E{number + 1})",
        )
    return s
