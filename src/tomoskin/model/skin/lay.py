"""A skin for a surface that was scanned or drawn, electrodes at positions in space."""

from __future__ import annotations

from os import PathLike, path
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DIMENSIONS, FloatArray, GeometryError
from tomoskin.model.mesh import Draped
from tomoskin.model.skin.skin import Skin

_STRAIGHT = 0.002
"""The rim is drawn with the fewest corners that stay within this part of its extent."""

_TOO_SMALL = 5e-3
"""A surface that extends over fewer metres was read in a unit that is too small."""

_FEWEST = 4
_APART = 0.1
"""Electrodes lie at least this part of the surface's extent apart, first to last."""


def lay(
    file: str | PathLike[str],
    electrodes: ArrayLike,
    *,
    unit: str = "mm",
    like: Skin,
    source: str = "",
) -> Skin:
    """Skin on the surface of a .stl, .obj, .ply or .dae file.

    Parameters
    ----------
    file
        The surface.
    electrodes
        (n, 3) middle of each electrode on the rim, E1 first, in the file's coordinates.
    unit
        Of these coordinates: "mm", "cm" or "m".
    like
        Skin that width and contact of the electrodes, material, drive and settings come from.
    source
        The skin file that it will be; it names the surface from there.

    Raises
    ------
    TomoskinError
        For a surface that is no sheet, coordinates that seem to be in another unit, or an
        electrode off the surface or its rim, by number.
    """
    scale = DIMENSIONS["length"][unit]
    draped = Draped.read(Path(file), scale=scale)
    middles = scale * np.asarray(electrodes, dtype=np.float64)
    _check_sizes(draped.points, middles, str(file), unit)
    positions = draped.place(middles, [f"E{n + 1}" for n in range(len(middles))])
    rim = fewer_corners(draped.outline.vertices)
    given = like.document["electrodes"]
    from_there = path.relpath(file, Path(source).parent)
    contact = given["contact_impedance"]
    return like.altered(
        {
            "skin": {"name": Path(file).stem, "description": f"On {Path(file).name}."},
            "outline": dict.fromkeys(like.document["outline"])
            | {"shape": "polygon", "vertices": _in_mm(rim)},
            "surface": dict.fromkeys(like.document["surface"])
            | {"shape": "file", "file": from_there, "unit": unit},
            "electrodes": dict.fromkeys(given)
            | {
                "positions": _in_mm(positions),
                "width": given["width"],
                "contact_impedance": contact if isinstance(contact, str) else contact[0],
            },
        },
        source=source or "skin",
    )


def fewer_corners(rim: FloatArray) -> FloatArray:
    """The corners (n, 2) of a closed line that it cannot do without (Douglas & Peucker 1973)."""
    reach = _STRAIGHT * float(np.ptp(rim, axis=0).max())
    far = int(np.linalg.norm(rim - rim[0], axis=1).argmax())
    closed = np.vstack([rim, rim[:1]])
    kept, open_ends = {0, far}, [(0, far), (far, len(rim))]
    while open_ends:
        first, last = open_ends.pop()
        along = closed[last] - closed[first]
        between = closed[first + 1 : last] - closed[first]
        if not len(between):
            continue
        t = np.clip(between @ along / max(float(along @ along), 1e-300), 0.0, 1.0)
        gap = np.linalg.norm(between - t[:, None] * along, axis=1)
        worst = int(gap.argmax())
        if gap[worst] > reach:
            middle = first + 1 + worst
            kept.add(middle)
            open_ends += [(first, middle), (middle, last)]
    return np.asarray(rim[sorted(kept)])


def _check_sizes(surface: FloatArray, electrodes: FloatArray, file: str, unit: str) -> None:
    """Refuse a surface, or electrodes on it, in another unit than what is said."""
    extent, between = (float(np.ptp(xyz, axis=0).max()) for xyz in (surface, electrodes))
    if extent < _TOO_SMALL:
        raise GeometryError(
            f"extends over {1e3 * extent:.4g} mm, read in {unit}",
            where=file,
            hint="if the file is in metres, say so: --unit m",
        )
    if len(electrodes) < _FEWEST:
        raise GeometryError(
            f"expected at least {_FEWEST} electrodes, got {len(electrodes)}", where="electrodes"
        )
    if between < _APART * extent:
        raise GeometryError(
            f"the electrodes lie within {1e3 * between:.4g} mm, but the surface extends over "
            f"{1e3 * extent:.4g} mm",
            where="electrodes",
            hint="give their positions in the coordinates and the unit of the surface's file",
        )


def _in_mm(points: FloatArray) -> list[list[str]]:
    return [[f"{1e3 * x:.4f} mm" for x in point] for point in points.tolist()]
