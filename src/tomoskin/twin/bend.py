"""Bending and stretching of the twin's sheet: the strain of the layer that conducts.

The layer lies a height h above the surface that keeps its length, as the far side of a foam does
that is glued to a body. There it has the metric G − 2h·II + h²·III of a parallel surface (do Carmo,
Differential Geometry of Curves and Surfaces, 3.5, exercise 11), II being the curvature, negative
where the front is convex. Its strain is Hencky's, ½ log C with C the metric now in units of that at
rest (Hencky 1928): a sheet whose own material conducts on as it did, gauge 0 and gauge_across 2,
then conducts as the stretched mesh does, exactly, and any other gauge holds what the geometry does
beside what the material does, as it is measured on strips.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from tomoskin.core import FloatArray, GeometryError
from tomoskin.model.mesh import Surface
from tomoskin.twin.dent import turned
from tomoskin.twin.parameters import check_numbers, parameter

_MOST_STRETCH = 1.0
_LEAST = 1e-6
"""A layer whose metric shrinks below this part has been folded."""


@dataclass(frozen=True, slots=True)
class BendSettings:
    """Where the conductive layer lies in what is bent."""

    height: float = parameter(
        3e-3,
        "m",
        "Height of the conductive layer above the surface whose length does not change.",
        "thickness of the foam, which is glued to the body that bends",
    )

    def __post_init__(self) -> None:
        """Check that the height is not negative."""
        check_numbers(self, least="height")


class Deformation(ABC):
    """What is done to a sheet as a whole, beside what presses on it."""

    @abstractmethod
    def strain(self, uv: FloatArray, rest: Surface, height: float) -> FloatArray:
        """(n, 3) strain xx, yy, xy of the layer at ``uv`` (n, 2) m, against the ``rest`` shape.

        ``height`` m above the surface that keeps its length. Raises GeometryError where the
        sheet cannot take that shape.
        """

    def depth(self, uv: FloatArray) -> FloatArray:
        """(n,) m by which the body under the sheet gives way at ``uv``: none, for most."""
        return np.zeros(len(uv))


@dataclass(frozen=True)
class Bent(Deformation):
    """The sheet lies on another surface than at rest; its points keep their (u, v)."""

    surface: Surface

    def strain(self, uv: FloatArray, rest: Surface, height: float) -> FloatArray:
        """The strain of the layer at ``height`` against the sheet at rest."""
        self.surface.check(uv)
        now, before = (layer_metric(one, uv, height) for one in (self.surface, rest))
        return hencky(now, before)


@dataclass(frozen=True)
class Stretched(Deformation):
    """Stretched evenly: along an axis, and across it.

    Attributes
    ----------
    along, across
        Relative elongations: 0.05 is 5 % longer.
    axis
        Rad from u, counter-clockwise.
    """

    along: float
    across: float = 0.0
    axis: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what would tear or crush the sheet."""
        for value in (self.along, self.across):
            if not -0.5 <= value <= _MOST_STRETCH:
                raise GeometryError(
                    f"expected an elongation from -50 to {100 * _MOST_STRETCH:g} %, "
                    f"got {100 * value:g} %"
                )

    def strain(self, uv: FloatArray, rest: Surface, height: float) -> FloatArray:
        """See :class:`Deformation`; the same at all heights."""
        del rest, height
        own = np.array([[math.log1p(self.along), math.log1p(self.across), 0.0]])
        return np.tile(turned(own, self.axis), (len(uv), 1))


Pose = tuple[Deformation, ...]
"""Deformations at once; their strains add up, exactly where their directions agree, else to first
order."""


def strain_of(pose: Pose, uv: FloatArray, rest: Surface, height: float) -> FloatArray:
    """(n, 3) xx, yy, xy of all deformations of a ``pose`` together."""
    each = (deformation.strain(uv, rest, height) for deformation in pose)
    return sum(each, np.zeros((len(uv), 3)))


def depth_of(pose: Pose, uv: FloatArray) -> FloatArray:
    """(n,) m of all deformations of a ``pose`` together."""
    return sum((deformation.depth(uv) for deformation in pose), np.zeros(len(uv)))


def layer_metric(surface: Surface, uv: FloatArray, height: float) -> FloatArray:
    """(n, 2, 2) metric of the layer ``height`` m above ``surface``.

    Raises GeometryError where the layer would fold.
    """
    metric = surface.metric(uv)
    if height == 0.0:
        return metric
    second = surface.curvature(uv)
    shape = np.linalg.solve(metric, second)
    if (1.0 - height * np.linalg.eigvals(shape).real <= 0.05).any():
        raise GeometryError(
            f"the layer {1e3 * height:.3g} mm above the surface folds, because the surface "
            "is too hollow there",
            hint="bend the sheet less, or over a greater length",
        )
    return np.asarray(metric - 2 * height * second + height**2 * (second @ shape))


def hencky(now: FloatArray, before: FloatArray) -> FloatArray:
    """(n, 3) xx, yy, xy of ½ log C, C the metric ``now`` in the frame of the one ``before``.

    The frame's first axis is the direction of u, as that of a mesh's tensors is (``Mesh.corners``).
    """
    frame = np.linalg.inv(np.linalg.cholesky(before))
    c = frame @ now @ frame.transpose(0, 2, 1)
    xx, yy, xy = c[:, 0, 0], c[:, 1, 1], c[:, 0, 1]
    mean, half = (xx + yy) / 2, (xx - yy) / 2
    ratio = np.hypot(half, xy) / mean
    level = np.log(np.maximum(mean**2 - half**2 - xy**2, _LEAST)) / 4
    # log C has the directions of C: its deviator is atanh(d/m)/d of C's
    safe = np.clip(ratio, _LEAST, 1 - _LEAST)
    slope = np.arctanh(safe) / safe / mean / 2
    return np.column_stack([level + slope * half, level - slope * half, slope * xy])
