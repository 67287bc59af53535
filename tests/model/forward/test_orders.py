"""Orders of convergence on plane sheets, each with the order that theory gives.

The current density jumps to zero where an electrode ends, and the potential is r log r there. In
a mesh of size h the squared energy of the error, which is the error of the resistance, is then
h² log(1/h) for linear and h² for quadratic elements, however smooth the rest is. Polygons in place
of a circle cost h² as well. Where electrodes end in the corners of a rectangle alone, the potential
is r² log r at worst, and quadratic elements have their full order 4, but for a logarithm.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from convergence import check_order, check_order_with_log
from golden import mismatch
from oracles import Corner, disc_resistance, inclusion, tube
from shapes import disc, patched, refined, rings, strip
from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel, State
from tomoskin.model.mesh import Mesh
from tomoskin.model.pattern import Pattern

PAIR = Pattern.from_tables([[0, 1]], [[0, 1]])
MIDDLES = np.array([0.05, 0.15, 0.25, 0.35])
QUARTERS, COS = np.arange(4) * np.pi / 2, np.cos(np.pi / 8)
CORNER = Corner(0.3, 0.2, 2.0, left=0.3, lower=0.2)


def resistance(mesh: Mesh, sigma: FloatArray | float, z: FloatArray, order: int) -> FloatArray:
    model = ForwardModel(mesh, Pattern.adjacent(len(mesh.electrodes)), z, order=order)
    return np.asarray(model.transfer_resistance(sigma))


# Electrodes on whole sides.


def corner_state(n: int, order: int) -> State:
    sheet = strip(np.linspace(0, 0.3, 3 * n + 1), np.linspace(0, 0.2, 2 * n + 1))
    mesh = patched(sheet, lambda p: p[:, 0] == 0, lambda p: p[:, 1] == 0)
    model = ForwardModel(mesh, PAIR, [CORNER.left, CORNER.lower], order=order)
    return model.at(CORNER.conductivity)


def corner_errors(order: int) -> list[float]:
    found = [corner_state(n, order).voltages[0] for n in (2, 4, 8, 16)]
    return [1 - v / CORNER.resistance for v in found]


def test_voltage_with_electrodes_on_whole_sides() -> None:
    linear, quadratic = corner_errors(1), corner_errors(2)
    check_order(linear, 2)
    check_order_with_log(quadratic, 4)
    # the energy of a Galerkin solution is too small, never too large
    assert min(linear + quadratic) > 0
    assert quadratic[-1] < 1e-4 * linear[-1]


def field_errors(state: State) -> tuple[float, float]:
    """L² and H¹ norms of the error of the potential, V·m and V, by quadrature of degree 4."""
    mesh, element = state.model.mesh, state.model.assembly.element
    nodal = state.basis[element.cells, 0]
    place, weight = triangle_rule(3)
    corner = mesh.points[mesh.cells]
    where = np.einsum("qk,nkd->nqd", place, corner)
    exact, slope = replace(CORNER, terms=200).field(*where.reshape(-1, 2).T)
    shape, by_place = shape_functions(place, state.model.order)
    inverse = np.linalg.inv(corner[:, 1:] - corner[:, :1])
    linear = np.concatenate([-inverse.sum(axis=2, keepdims=True), inverse], axis=2)
    got = np.einsum("qs,ns->nq", shape, nodal)
    got_slope = np.einsum("qsk,ndk,ns->nqd", by_place, linear, nodal)
    size = mesh.volumes[:, None] * weight
    potential = ((got - exact.reshape(got.shape)) ** 2 * size).sum()
    gradient = (((got_slope - slope.reshape(got_slope.shape)) ** 2).sum(axis=2) * size).sum()
    return float(np.sqrt(potential)), float(np.sqrt(gradient))


def triangle_rule(n: int) -> tuple[FloatArray, FloatArray]:
    """Barycentric points (n², 3) and weights that sum to 1: Gauss in a square that collapses."""
    x, w = np.polynomial.legendre.leggauss(n)
    a, b = (g.ravel() for g in np.meshgrid((x + 1) / 2, (x + 1) / 2))
    weight = np.outer(w, w).ravel() / 2 * (1 - a)
    return np.column_stack([a, b * (1 - a), (1 - a) * (1 - b)]), weight


def shape_functions(place: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Values (q, s) and derivatives by the barycentrics (q, s, 3): corners, then sides."""
    if order == 1:
        return place, np.broadcast_to(np.eye(3), (len(place), 3, 3))
    values = [place * (2 * place - 1)]
    slopes = [(4 * place - 1)[:, :, None] * np.eye(3)]
    for i, j in combinations(range(3), 2):
        values.append(4 * place[:, [i]] * place[:, [j]])
        slopes.append(4 * (place[:, [i], None] * np.eye(3)[j] + place[:, [j], None] * np.eye(3)[i]))
    return np.hstack(values), np.concatenate(slopes, axis=1)


def test_potential_with_electrodes_on_whole_sides() -> None:
    """Norms in L² and H¹: h² and h; h³ and h² but for the root of the logarithm."""
    linear, quadratic = (
        np.array([field_errors(corner_state(n, order)) for n in (2, 4, 8)]).T for order in (1, 2)
    )
    check_order(linear[0], 2)
    check_order(linear[1], 1)
    check_order_with_log(quadratic[0] ** 2, 6)
    check_order_with_log(quadratic[1] ** 2, 4)


# Electrodes that end within a side.


def mirrored(
    length: float, height: float, middles: FloatArray, width: float, z: float
) -> FloatArray:
    """Rectangle with electrodes on its lower side: half of a tube that is twice as long."""
    radius = length / np.pi
    centres = np.concatenate([middles, -middles]) / radius
    r = disc_resistance(
        radius,
        2.0,
        centres,
        width / 2 / radius,
        np.full(len(centres), z),
        factor=tube(height / radius),
    )
    n = len(middles)
    return r[:n, :n] + r[:n, n:]


def within_a_side(n: int, order: int) -> FloatArray:
    sheet = strip(np.linspace(0, 0.4, 16 * n + 1), np.linspace(0, 0.1, 4 * n + 1))
    patches = [lambda p, m=m: (p[:, 1] == 0) & (np.abs(p[:, 0] - m) < 0.025) for m in MIDDLES]
    return resistance(patched(sheet, *patches), 2.0, np.full(4, 0.02), order)


def test_electrodes_that_end_within_a_side() -> None:
    exact = mirrored(0.4, 0.1, MIDDLES, 0.05, 0.02)
    linear, quadratic = (
        [mismatch(within_a_side(n, order), exact) for n in (1, 2, 4)] for order in (1, 2)
    )
    check_order_with_log(linear, 2)
    check_order(quadratic, 2)
    assert quadratic[-1] < linear[-1] / 10


# Discs.


def on_circle(points: FloatArray) -> FloatArray:
    return np.asarray(0.1 * points / np.linalg.norm(points, axis=1, keepdims=True))


def test_disc_with_complete_electrodes() -> None:
    z, centres = np.geomspace(0.01, 0.1, 8), np.pi / 2 - 2 * np.pi * np.arange(8) / 8
    exact = disc_resistance(0.1, 2.0, centres, 0.15, z)
    meshes = [disc(8, 250, width=0.03)]
    for _ in range(2):
        meshes.append(refined(meshes[-1], on_circle))
    linear, quadratic = (
        [mismatch(resistance(m, 2.0, z, order), exact) for m in meshes] for order in (1, 2)
    )
    check_order_with_log(linear, 2)
    check_order(quadratic, 2)
    assert quadratic[-1] < linear[-1] / 10


def inclusion_resistance(n: int, contrast: float, order: int) -> FloatArray:
    radii = np.concatenate([np.linspace(0, 0.06, 2 * n + 1), np.linspace(0.06, 0.1, 2 * n + 1)[1:]])
    patches = [lambda p, c=c: np.cos(np.arctan2(p[:, 1], p[:, 0]) - c) > COS for c in QUARTERS]
    mesh = patched(rings(radii[1:], 16 * n), *patches)
    inside = np.linalg.norm(mesh.centroids, axis=1) < 0.06
    return resistance(mesh, np.where(inside, 2.0 * contrast, 2.0), np.full(4, 0.02), order)


@pytest.mark.parametrize("contrast", [1e-9, 0.2, 5.0, 1e3])
def test_concentric_inclusion(contrast: float) -> None:
    factor = inclusion(contrast, 0.6)
    exact = disc_resistance(0.1, 2.0, QUARTERS, np.pi / 8, np.full(4, 0.02), factor=factor)
    linear, quadratic = (
        [mismatch(inclusion_resistance(n, contrast, order), exact) for n in (1, 2, 4)]
        for order in (1, 2)
    )
    check_order_with_log(linear, 2)
    check_order(quadratic, 2)
    assert quadratic[-1] < linear[-1] / 10


def test_an_inclusion_is_seen() -> None:
    """The factor's limits: none at all, an insulator and a short circuit that reach the rim."""
    m = np.arange(1.0, 5.0)
    assert inclusion(1.0, 0.6)(m) == pytest.approx(1.0)
    assert inclusion(0.1, 1.0)(m) == pytest.approx(10.0)
    assert inclusion(10.0, 1.0)(m) == pytest.approx(0.1)
    assert (inclusion(0.0, 0.6)(m) > 1.0).all()
