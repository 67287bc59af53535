"""Figures of merit: of operators, as agreed on for GREIT (Adler et al. 2009), and the thesis's four
of an image, its section 4.4.1."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tomoskin.core import DataError, FloatArray, Image, IntArray, TomoskinError
from tomoskin.imaging.linear.operator import Operator
from tomoskin.imaging.trained.targets import Balls, Targets, centre_of
from tomoskin.model.mesh import Mesh

_LEVEL = 0.25
"""What counts as the target in the image: a quarter of the greatest value, section 3.1."""


def deviations(noise: ArrayLike, n_meas: int, error: type[TomoskinError] = DataError) -> FloatArray:
    """(n_meas,) standard deviations of data, of these or one number; an ``error`` for others."""
    sd = np.asarray(noise, dtype=np.float64)
    if sd.shape not in ((), (n_meas,)):
        raise error(f"expected noise of shape ({n_meas},), got {sd.shape}")
    if not (np.isfinite(sd).all() and (sd >= 0).all() and sd.any()):
        raise error(f"expected finite noise above 0, got {sd.min():g} to {sd.max():g}")
    return np.broadcast_to(sd, (n_meas,))


def noise_figure(
    matrix: FloatArray, volumes: FloatArray, signal: FloatArray, noise: ArrayLike = 1.0
) -> float:
    """Signal-to-noise ratio of the data over that of the image (Adler & Guardo 1996).

    With image x = A B z, where A is the area of each cell and B the operator,

        NF = (mean|z| / rms sd(z)) / (mean|x| / rms sd(x)),

    z the data of a small target in the middle. Independent of the size of signal and noise.
    Definitions differ in how they average (EIDORS has several); compare like with like.

    Parameters
    ----------
    matrix
        (n_cells, n_meas).
    volumes
        (n_cells,) m² or m³.
    signal
        (n_meas,) noise-free difference data of the target.
    noise
        Standard deviation of the data: one number, or (n_meas,).

    Raises
    ------
    DataError
        When the signal is zero, or the noise is not above 0 or of another shape.
    """
    sd = deviations(noise, len(signal))
    image = np.abs(volumes * (matrix @ signal)).mean()
    if not (signal.any() and image > 0):
        raise DataError("the target causes no signal, or no image")
    spread = np.einsum("cm,cm,m->c", matrix, matrix, sd**2, optimize=True)
    image_noise = np.sqrt((volumes**2 * spread).mean())
    return float((np.abs(signal).mean() / np.sqrt((sd**2).mean())) / (image / image_noise))


@dataclass(frozen=True, eq=False)
class Merit:
    """Five figures per target, and the operator's noise figure.

    With the set of cells at or above a quarter of the image's maximum, and the disc of the same
    area around its centroid (Adler et al. 2009, section 3.1):

    Attributes
    ----------
    distance
        (n,) m, of the target from the sheet's centroid.
    amplitude
        (n,) image summed over the sheet, over the change that there was: best 1, or the same
        everywhere.
    position_error
        (n,) m, distance of the target from the centre less that of the set: above 0 where the
        image is drawn inwards.
    offset
        (n,) m, distance between target and set: the same without a sign or a centre.
    resolution
        (n,) root (of the dimension) of the set's share of the sheet: small is sharp.
    deformation
        (n,) share of the set that lies outside its disc.
    ringing
        (n,) image of the wrong sign outside the disc, over the image within it.
    noise_figure
        For the target nearest to the centre, see :func:`noise_figure`.
    """

    distance: FloatArray
    amplitude: FloatArray
    position_error: FloatArray
    offset: FloatArray
    resolution: FloatArray
    deformation: FloatArray
    ringing: FloatArray
    noise_figure: float


def figures(operator: Operator, targets: Targets, noise: ArrayLike = 1.0) -> Merit:
    """Figures of merit of ``operator`` over ``targets``; NaN where the image has no maximum.

    Works on the cells by area, on sheets of any shape and on volumes.

    Parameters
    ----------
    noise
        Standard deviation of the data, one number or (n_meas,), for the noise figure.

    Raises
    ------
    DataError
        When the targets have other rows or another kind of difference than the operator.
    """
    if targets.pattern_id != operator.model.pattern.identity:
        raise DataError("the targets were simulated for another pattern")
    if targets.difference != operator.difference:
        raise DataError(
            f'the operator takes "{operator.difference}" differences, '
            f'the targets are "{targets.difference}"'
        )
    mesh = operator.model.mesh
    balls, centre = Balls(mesh), centre_of(mesh)
    distance = np.linalg.norm(targets.places - centre, axis=1)
    images = targets.dv @ operator.matrix.T
    table = np.array(
        [
            _of_image(image, balls, position, float(amount), centre)
            for image, position, amount in zip(images, targets.places, targets.amount, strict=True)
        ]
    )
    middle = targets.dv[int(distance.argmin())]
    loss = noise_figure(operator.matrix, mesh.volumes, middle, noise)
    amplitude, position, offset, resolution, deformation, ringing = table.T
    return Merit(distance, amplitude, position, offset, resolution, deformation, ringing, loss)


def _of_image(
    image: FloatArray, balls: Balls, position: FloatArray, amount: float, centre: FloatArray
) -> tuple[float, ...]:
    """The figures of one image, in the record's order."""
    mesh = balls.mesh
    upright = image * np.sign(amount)
    top = upright.max()
    if not top > 0:
        return 6 * (np.nan,)
    content = mesh.volumes * upright
    in_set = mesh.volumes * (upright >= _LEVEL * top)
    size = in_set.sum()
    middle = in_set @ mesh.centroids / size
    share = balls.share(middle, radius_of(size, mesh.dimension))
    wrong = np.minimum(content, 0.0) @ (1.0 - share)
    return (
        content.sum() / abs(amount),
        float(np.linalg.norm(position - centre) - np.linalg.norm(middle - centre)),
        float(np.linalg.norm(position - middle)),
        float((size / mesh.volumes.sum()) ** (1.0 / mesh.dimension)),
        float(in_set @ (1.0 - share) / size),
        float(-wrong / (content @ share)),
    )


def radius_of(size: float, dimension: int) -> float:
    """Radius, m, of the disc of that area or the ball of that volume."""
    if dimension == 2:
        return float(np.sqrt(size / np.pi))
    return float(np.cbrt(0.75 * size / np.pi))


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
        values = _shown(image, mesh)
        peak = float(values[np.abs(values).argmax()])
        size = values * np.sign(peak)
        half, quarter = (np.flatnonzero(size >= part * abs(peak)) for part in (0.5, 0.75))
        res50, res75 = _sharpness(len(half), len(values)), _sharpness(len(quarter), len(values))
        return cls(
            maximum=peak,
            res50=res50,
            res75=res75,
            shape_angle=float(np.arctan2(0.25 * abs(peak), (res75 - res50) / 2.0)),
            error75=np.nan if truth is None else _distance(mesh, quarter, truth),
        )


def _sharpness(over: int, total: int) -> float:
    return float(1.0 - np.sqrt((over - 1) / total))


def _distance(mesh: Mesh, cells: IntArray, truth: ArrayLike) -> float:
    position = np.asarray(truth, dtype=np.float64)
    d = mesh.points.shape[1]
    if position.shape != (d,) or not np.isfinite(position).all():
        raise DataError(f"expected the true centroid as {d} finite coordinates, got {truth!r}")
    weight = mesh.volumes[cells]
    return float(np.linalg.norm(weight @ mesh.centroids[cells] / weight.sum() - position))


def _shown(image: Image, mesh: Mesh) -> FloatArray:
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
