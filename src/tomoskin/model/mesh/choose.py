"""Electrodes of a mesh that comes from elsewhere: by name, facets or a function."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import FloatArray, GeometryError, IntArray
from tomoskin.model.mesh.triangles import boundary_facets

_NUMBERED = re.compile(r"(?:e|el|elec|electrode)[\s_-]*(\d+)", re.IGNORECASE)

Chooser = Callable[[FloatArray], ArrayLike]
"""(n, d) centroids of boundary facets → (n,) electrode of each, −1 for none."""


Electrodes = Sequence[str] | Sequence[ArrayLike] | Chooser | None
"""How electrodes are given: names of groups in the file, in their order; facet arrays in the
file's own point numbers; a function of centroids; None for the groups named E1, E2, …"""


def choose(
    points: FloatArray, cells: IntArray, groups: Mapping[str, IntArray], electrodes: Electrodes
) -> tuple[IntArray, ...]:
    """Facets (n, k − 1) of each electrode.

    Raises
    ------
    GeometryError
        When a group does not exist, or an electrode has no facet.
    """
    match electrodes:
        case None:
            chosen = _named(groups, _numbered(groups))
        case _ if callable(electrodes):
            chosen = _numbers(points, cells, electrodes)
        case _ if any(isinstance(e, str) for e in electrodes):
            chosen = _named(groups, [str(e) for e in electrodes])
        case _:
            chosen = [np.asarray(e) for e in electrodes]
    for number, facets in enumerate(chosen):
        if not facets.size:
            raise GeometryError("has no facet on the boundary", where=f"E{number + 1}")
    return tuple(chosen)


def _numbered(groups: Mapping[str, IntArray]) -> list[str]:
    """Names of the groups that are called after an electrode, by its number."""
    numbered = {name: m for name in groups if (m := _NUMBERED.fullmatch(name.strip()))}
    if not numbered:
        raise GeometryError(
            f"no group is named as an electrode (E1, E2, …); {_listing(groups)}",
            hint="say which facets are electrodes: electrodes=…",
        )
    return sorted(numbered, key=lambda name: int(numbered[name][1]))


def _named(groups: Mapping[str, IntArray], names: Sequence[str]) -> list[IntArray]:
    for name in names:
        if name not in groups:
            raise GeometryError(f'no group of facets is named "{name}"; {_listing(groups)}')
    return [groups[name] for name in names]


def _listing(groups: Mapping[str, IntArray]) -> str:
    return f"groups: {', '.join(groups)}" if groups else "the file has no groups of facets"


def _numbers(points: FloatArray, cells: IntArray, chooser: Chooser) -> list[IntArray]:
    facets = boundary_facets(cells)
    if not len(facets):
        raise GeometryError("the surface is closed: it has no rim for electrodes")
    number = np.asarray(chooser(points[facets].mean(axis=1)))
    if number.shape != (len(facets),) or number.dtype.kind not in "iu":
        raise GeometryError(
            f"expected one whole number for each of {len(facets)} facets, "
            f"got {number.dtype} of shape {number.shape}"
        )
    return [facets[number == n] for n in range(1 + int(number.max()))]
