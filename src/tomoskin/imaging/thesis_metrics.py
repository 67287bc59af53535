"""The thesis's four metrics of an image, its section 4.4.1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray, Image, IntArray
from tomoskin.model.mesh import Mesh


@dataclass(frozen=True, slots=True)
class ThesisMetrics:
    """Metrics on the values of the elements, section 4.4.1.

    Attributes
    ----------
    maximum
        Greatest change, signed, in the image's unit.
    res50, res75
        1 − √((elements over 50 % (75 %) of the maximum − 1) / elements), equation (4.1).
    shape_angle
        β = atan(25 % of the maximum / ((res75 − res50) / 2)), rad, equation (4.2): π/2 for a
        sharp edge (res75 = res50). It depends on the image's unit, as in the thesis.
    error75
        Distance, m, of the true centroid from that of the elements over 75 %, equation (4.3);
        NaN where the truth is not known.
    """

    maximum: float
    res50: float
    res75: float
    shape_angle: float
    error75: float

    @classmethod
    def of(cls, image: Image, mesh: Mesh, truth: ArrayLike | None = None) -> ThesisMetrics:
        """Metrics of ``image`` on its ``mesh``; ``truth`` (d,) is the stimulus' centroid, m.

        Changes of the sign of the greatest one count; a value at a threshold is over it.

        Raises
        ------
        DataError
            When the image belongs to another mesh, is complex, holds values that are not finite
            or no change at all, or the truth is not a position.
        """
        values = _checked(image, mesh)
        peak = float(values[np.abs(values).argmax()])
        size = values * np.sign(peak)
        half, quarter = (np.flatnonzero(size >= part * abs(peak)) for part in (0.5, 0.75))
        res50, res75 = _resolution(len(half), len(values)), _resolution(len(quarter), len(values))
        return cls(
            maximum=peak,
            res50=res50,
            res75=res75,
            shape_angle=float(np.arctan2(0.25 * abs(peak), (res75 - res50) / 2.0)),
            error75=np.nan if truth is None else _error(mesh, quarter, truth),
        )


def _resolution(over: int, total: int) -> float:
    return float(1.0 - np.sqrt((over - 1) / total))


def _error(mesh: Mesh, cells: IntArray, truth: ArrayLike) -> float:
    position = np.asarray(truth, dtype=np.float64)
    d = mesh.points.shape[1]
    if position.shape != (d,) or not np.isfinite(position).all():
        raise DataError(f"expected the true centroid as {d} finite coordinates, got {truth!r}")
    weight = mesh.volumes[cells]
    return float(np.linalg.norm(weight @ mesh.centroids[cells] / weight.sum() - position))


def _checked(image: Image, mesh: Mesh) -> FloatArray:
    if image.mesh_id != mesh.identity:
        raise DataError(f"the image belongs to mesh {image.mesh_id}, not to mesh {mesh.identity}")
    if np.iscomplexobj(image.values):
        raise DataError(
            "expected a real image, got a complex one", hint="take its real or imaginary part"
        )
    if not np.isfinite(image.values).all():
        raise DataError("expected finite values in the image, got others")
    if not image.values.any():
        raise DataError("the image shows no change, so it has no metrics")
    return image.values
