"""Making a table of what one spot does, and changing it to that of an uneven sheet.

The exact model is asked at every point of the table once, on an even sheet. What unevenness does
is nearly linear: of each change it is the same part as of the linear model's, to 0.1 % of the
change on sheets uneven by 20 %. So another sheet costs one product a radius.
"""

from __future__ import annotations

import hashlib
from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import spline_filter1d

from tomoskin.core import Arrays, FloatArray, kept, reach
from tomoskin.sensing.fit.certificate import Certificate
from tomoskin.sensing.fit.scattering import (
    Lattice,
    Scattering,
    depth_nodes,
    lattices,
    layout,
    sheet_identity,
)
from tomoskin.sensing.fit.spot import Response
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.fit.table import ABREAST, N_DIRECTIONS, ResponseTable

NEGLIGIBLE, SAMPLED = 3e-5, 3000
"""Part of the largest change below which a direction of the data counts as none, by so many."""

FAINT = -0.3
"""Near this depth it is taken what a shape does; that is in proportion to the depth."""

UNCLEAR = 1e-9
"""Part of the largest square below which a linear change is no measure of an exact one."""

_PIECE = 80_000
"""Numbers that are filtered in a piece of work: less than a millisecond."""

_SUMS = 8_000_000
"""Products that are summed in a piece of work: as long."""

_BLOCKS = 8
"""Of cells whose fields are compared, one in a piece of work."""


@dataclass(frozen=True, eq=False)
class Tabulation:
    """A table of an even sheet, and what it takes to change it to that of an uneven one.

    Attributes
    ----------
    table
        Of ``response``.
    parts
        (n_points, n_nodes): each change divided by s, in parts of the linear model's change.
    certificate
        How far the table is from the exact model.
    """

    response: Response
    table: ResponseTable
    parts: FloatArray
    certificate: Certificate

    @classmethod
    def of(cls, response: Response, prior: SpotPrior, sign: str) -> Self:
        """For spots as the ``prior`` and the ``sign`` allow them."""
        log_radii, grids = layout(response, prior)
        nodes, every = depth_nodes(prior, sign), lattices(response, prior)
        scattering = Scattering.kept(response, prior, sign)
        changes = scattering.by_lattice(every)
        basis = _basis(scattering.table, nodes, response.by_transfer)
        values, parts = [], []
        for lattice, change in zip(every, changes, strict=True):
            reach()
            samples, part = _sampled(response, lattice, change, nodes, basis)
            values.append(_filtered(samples[lattice.nearest], lattice.grid.shape))
            parts.append(part[lattice.nearest])
        table = ResponseTable(
            log_radii, grids, sign, nodes, np.concatenate(values).astype(np.float32), basis
        )
        certificate = Certificate.of(response, table, prior, scattering.alone, scattering.pairs)
        return cls(response, table, np.concatenate(parts), certificate)

    @classmethod
    def unpacked(cls, arrays: Arrays, response: Response, prior: SpotPrior, sign: str) -> Self:
        """Of the arrays that :meth:`packed` made of the same."""
        log_radii, grids = layout(response, prior)
        nodes = depth_nodes(prior, sign)
        table = ResponseTable(log_radii, grids, sign, nodes, arrays["values"], arrays["basis"])
        return cls(response, table, arrays["parts"], Certificate.unpacked(arrays))

    def packed(self) -> Arrays:
        """The arrays that take long to compute."""
        table = self.table
        return {
            "values": table.values,
            "basis": table.basis,
            "parts": self.parts,
            **self.certificate.packed(),
        }

    def adapted(self, response: Response) -> Generator[None, None, ResponseTable]:
        """The table of ``response``, another sheet on the same mesh, a piece between two yields."""
        table = self.table
        basis, n_nodes = table.basis.T, len(table.nodes)
        more = np.empty((len(response.by_cell), basis.shape[1]))
        for cells in np.array_split(np.arange(len(more)), _BLOCKS):
            yield
            more[cells] = (response.by_cell[cells] - self.response.by_cell[cells]) @ basis
        values, start = np.empty_like(table.values), 0
        for lattice in self.lattices:
            yield
            linear = yield from _summing(lattice, more)
            here = slice(start, start + len(linear))
            yield
            values[here, n_nodes:] = table.values[here, n_nodes:]
            for node, part in product(
                range(n_nodes), _slices(len(linear), linear.shape[1], _PIECE)
            ):
                yield
                moved = self.parts[here, node, None] * linear[:, part]
                filtered = _filtered(moved, lattice.grid.shape)
                values[here, node, part] = table.values[here, node, part] + filtered
            start = here.stop
        return replace(table, values=values)

    @cached_property
    def lattices(self) -> list[Lattice]:
        """The spots of the table: half a second of work, for :meth:`adapted`."""
        spots, table = self.response.spots, self.table
        return [
            Lattice.of(spots, grid, float(np.exp(log_radius)))
            for log_radius, grid in zip(table.log_radii, table.grids, strict=True)
        ]


def kept_tabulation(response: Response, prior: SpotPrior, sign: str) -> Tabulation:
    """That of :meth:`Tabulation.of`, kept on disk."""

    def make() -> Arrays:
        return Tabulation.of(response, prior, sign).packed()

    arrays = kept(f"touch-{_identity(response, prior, sign)}", make)
    return Tabulation.unpacked(arrays, response, prior, sign)


def _identity(response: Response, prior: SpotPrior, sign: str) -> str:
    """Hash of all that a tabulation depends on."""
    model = response.state.model
    digest = hashlib.sha256(
        f"{sheet_identity(response, prior, sign)} {model.pattern.identity}".encode()
    )
    digest.update(np.ascontiguousarray(model.current, dtype=np.float64).tobytes())
    return digest.hexdigest()[:32]


def _summing(lattice: Lattice, slopes: FloatArray) -> Generator[None, None, FloatArray]:
    """(n_points, r) as :meth:`Lattice.linear`, each cell by its height; a piece of work between
    two yields."""
    feet = lattice.feet
    sums = feet.sums(feet.height, len(slopes))
    linear = np.empty((len(lattice.nearest), slopes.shape[1]))
    for part in _slices(sums.nnz, slopes.shape[1], _SUMS):
        yield
        linear[:, part] = (sums @ slopes[:, part])[lattice.nearest]
    return linear


def _sampled(
    response: Response,
    lattice: Lattice,
    change: NDArray[np.floating],
    nodes: FloatArray,
    basis: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """(n, n_nodes + N_DIRECTIONS, rank) V, and :attr:`Tabulation.parts`, of the spots of a lattice.

    ``change`` (n, n_nodes, q) Ω: see :class:`Scattering`.
    """
    feet, depths = lattice.feet, 4 * np.log1p(nodes)
    out = np.empty((len(change), len(nodes) + N_DIRECTIONS, len(basis)))
    out[:, : len(nodes)] = change @ (response.by_transfer @ basis.T) / nodes[:, None]
    slopes = response.by_cell @ basis.T
    parts = _parts(out[:, : len(nodes)], lattice.linear(slopes, feet.height))
    directed, reshaped = response.spots.flanks(feet)
    ways = zip(response.by_direction, directed, strict=True)
    out[:, -2] = sum(lattice.linear((basis @ way).T, part) for way, part in ways)
    faint = int(np.abs(depths - FAINT).argmin())
    less = parts[:, faint, None] * nodes[faint] / depths[faint]  # than the linear model has
    out[:, -1] = less * lattice.linear(slopes, reshaped)
    return out, parts


def _parts(samples: FloatArray, linear: FloatArray) -> FloatArray:
    """(n, k) amplitudes of ``linear`` (n, r) in ``samples`` (n, k, r); 0 where it is too faint."""
    square = np.einsum("nr,nr->n", linear, linear)
    clear = square > UNCLEAR * square.max()
    along = np.einsum("nkr,nr->nk", samples, linear)
    return np.where(clear[:, None], along / np.where(clear, square, 1.0)[:, None], 0.0)


def _basis(table: NDArray[np.floating], nodes: FloatArray, reads: FloatArray) -> FloatArray:
    """(rank, n_meas) what all changes are made of, but for a part of ``NEGLIGIBLE``.

    Of changes ``table`` (n, n_nodes, q) Ω, which rows read as ``reads`` (q, n_meas) V/Ω.
    """
    rows = (table / nodes[:, None]).reshape(-1, table.shape[2])
    rows = rows[:: max(1, len(rows) // SAMPLED)].astype(np.float64)
    across, along = np.linalg.qr(reads.T)
    square, basis = np.linalg.eigh(along @ (rows.T @ rows) @ along.T)
    wanted = int(np.count_nonzero(square > NEGLIGIBLE**2 * square[-1]))
    count = min(-(-wanted // ABREAST) * ABREAST, len(square))
    return np.ascontiguousarray((across @ basis[:, -count:]).T)


def _slices(size: int, rank: int, most: int) -> list[slice]:
    """Entries of the basis that make up a piece of work, each of that ``size``."""
    step = max(most // size, 1)
    return [slice(first, first + step) for first in range(0, rank, step)]


def _filtered(samples: FloatArray, shape: tuple[int, int]) -> FloatArray:
    """Spline coefficients of samples (n_points, ...) on a grid of that shape."""
    grid = samples.reshape(*shape, -1)
    rows, columns = map(_filter, shape)
    along = (rows @ grid.reshape(shape[0], -1)).reshape(grid.shape)
    return np.asarray((columns @ along).reshape(samples.shape))


@lru_cache(maxsize=64)
def _filter(count: int) -> FloatArray:
    """(count, count): spline coefficients on a line from samples there, mirrored at its ends."""
    return np.ascontiguousarray(spline_filter1d(np.eye(count), 3, axis=0, mode="mirror"))
