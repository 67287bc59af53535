"""Test targets, small discs of changed conductivity, and the exact voltages that they cause.

Figures of merit: of operators, as agreed on for GREIT (Adler et al. 2009), and the thesis's four
of an image, its section 4.4.1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from tomoskin.core import (
    DataError,
    FloatArray,
    Image,
    IntArray,
    ModelError,
    check_positive,
)
from tomoskin.imaging import Operator, noise_figure
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh

_PER_EDGE = 4


class Balls:
    """Discs on a sheet, or balls in a volume, as shares of the cells of ``mesh``.

    Each cell is sampled at points of equal weight (10 in a triangle, 20 in a tetrahedron).
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        share = _lattice(mesh.dimension)
        self._points_per_cell = len(share)
        self._points = np.einsum("qk,ckd->cqd", share, mesh.points[mesh.cells])

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self._points.reshape(-1, self._points.shape[2]))

    def each(self, positions: FloatArray, radius: float) -> Iterator[tuple[IntArray, FloatArray]]:
        """Cells (k,) and their share (k,) within ``radius`` m of each position, (n, d)."""
        for within in self._tree.query_ball_point(positions, radius):
            cells, count = np.unique(
                np.asarray(within, dtype=np.int64) // self._points_per_cell, return_counts=True
            )
            yield cells, count / self._points_per_cell

    def share(self, position: FloatArray, radius: float) -> FloatArray:
        """(n_cells,) share of each cell within ``radius`` m of ``position`` (d,)."""
        within = np.einsum("cqd,cqd->cq", *(2 * [self._points - position])) <= radius**2
        return np.asarray(within.mean(axis=1))


@lru_cache
def _lattice(dimension: int) -> FloatArray:
    """(q, dimension + 1) barycentric coordinates, evenly spread and off the edges."""
    steps = [s for s in product(range(_PER_EDGE), repeat=dimension) if sum(s) < _PER_EDGE]
    table = np.array([[*s, _PER_EDGE - 1 - sum(s)] for s in steps], dtype=np.float64)
    return np.asarray((table + 1.0 / (dimension + 1)) / _PER_EDGE)


@dataclass(frozen=True, eq=False)
class Targets:
    """Discs (in a volume, balls) of one size and contrast, one at a time.

    Attributes
    ----------
    places
        (n, d) m, the centroid of each target.
    amount
        (n,) change of conductivity, integrated over the target: S·m² or S/m·m³.
    dv
        (n, n_meas) difference data.
    difference
        Their kind, "plain" or "normalised".
    pattern_id
        ``Pattern.identity`` of their rows.
    """

    places: FloatArray
    amount: FloatArray
    dv: FloatArray
    difference: str
    pattern_id: str

    @classmethod
    def simulate(
        cls,
        model: ForwardModel,
        places: ArrayLike,
        *,
        radius: float,
        contrast: float = -0.1,
        conductivity: ArrayLike = 1.0,
        difference: str = "plain",
    ) -> Targets:
        """Targets at ``places`` (n, d), by the exact local update of ``model``.

        Give a finer mesh than that of the operator under test: its own would flatter it. A
        target over the rim is cut there.

        Raises
        ------
        ModelError
            For a radius that is not above 0, a contrast that is 0 or not above −1, a difference
            that is not known, or complex voltages.
        DataError
            For a position that has no cell within the radius, naming it.
        """
        table = _checked(places, model.mesh, radius, contrast, difference)
        state = model.at(conductivity)
        if state.conductivity.ndim > 1 or np.iscomplexobj(state.voltages):
            raise ModelError(
                "expected a real conductivity per cell and a real contact impedance, "
                "got tensors or complex values"
            )
        shares = list(Balls(model.mesh).each(table, radius))
        empty = [number for number, (cells, _) in enumerate(shares) if not len(cells)]
        if empty:
            raise DataError(
                "lies outside the sheet, or between its cells",
                where=f"target {empty[0]}",
                hint="move it, or choose a radius above the size of a cell",
            )
        sigma, content = state.conductivity, model.mesh.volumes
        touches = [(c, sigma[c] * (1.0 + contrast * share)) for c, share in shares]
        dv = state.local.voltages_of(touches) - state.voltages
        weights = [(c, share * content[c]) for c, share in shares]
        if difference == "normalised":
            dv /= np.abs(state.voltages)
        return cls(
            np.array([w @ model.mesh.centroids[c] / w.sum() for c, w in weights]),
            np.array([contrast * w @ sigma[c] for c, w in weights]),
            dv,
            difference,
            model.pattern.identity,
        )


def along(mesh: Mesh, end: ArrayLike, count: int) -> FloatArray:
    """(count, d) positions from the sheet's centroid towards ``end`` (d,) m, both included."""
    if count < 1:
        raise DataError(f"expected at least 1 target, got {count}")
    start = centre_of(mesh)
    return np.asarray(start + np.linspace(0, 1, count)[:, None] * (np.asarray(end) - start))


def centre_of(mesh: Mesh) -> FloatArray:
    """(d,) m: centroid of the sheet or volume."""
    return np.asarray(mesh.volumes @ mesh.centroids / mesh.volumes.sum())


def _checked(
    positions: ArrayLike, mesh: Mesh, radius: float, contrast: float, difference: str
) -> FloatArray:
    table = np.asarray(positions, dtype=np.float64)
    d = mesh.points.shape[1]
    if table.ndim != 2 or table.shape[1] != d or not len(table):
        raise DataError(f"expected positions of shape (n, {d}), got shape {table.shape}")
    if not np.isfinite(table).all():
        raise DataError("expected finite positions, got values that are not finite")
    check_positive(radius, "a radius", unit=" m")
    if not (np.isfinite(contrast) and contrast > -1 and contrast != 0):
        raise ModelError(f"expected a contrast above -1 and not 0, got {contrast}")
    if difference not in ("plain", "normalised"):
        raise ModelError(f'expected difference "plain" or "normalised", got "{difference}"')
    return table


_LEVEL = 0.25
"""What counts as the target in the image: a quarter of the greatest value, section 3.1."""


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
