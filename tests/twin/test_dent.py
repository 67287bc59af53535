"""Dents read at any points: moved, turned, blended and added, and the strain that they bring."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from tomoskin.twin import Circle, ContactSettings, Finger, Grid, Probe, Square
from tomoskin.twin.dent import bulge_strain, drag_strain, indent, slope_strain, solved_dent

FOAM = ContactSettings()
LINEAR = replace(FOAM, lock=math.inf)
SIDE = np.linspace(-0.06, 0.06, 121)
POINTS = np.stack(np.meshgrid(SIDE, SIDE, indexing="ij"), axis=-1).reshape(-1, 2)
CELL = (SIDE[1] - SIDE[0]) ** 2


def borne(load):
    return LINEAR.spring * load[3].sum() * CELL


@pytest.mark.parametrize("shape", [Circle(0.012), Finger(), Square(0.02, 0.05)], ids=repr)
@pytest.mark.parametrize("force", [0.05, 1.0, 3.3])
def test_the_body_bears_the_force(shape, force):
    load = indent([Probe(shape, 0.003, 0.002, force, 0.5)], LINEAR, POINTS)
    assert borne(load) == pytest.approx(force, rel=5e-3)


def test_a_flat_dent_is_linear_in_the_force_and_its_slope_strain_quadratic():
    one, two = (indent([Probe(Circle(0.012), 0, 0, f)], LINEAR, POINTS) for f in (1.0, 2.0))
    assert two[3] == pytest.approx(2 * one[3])
    stiff = replace(LINEAR, bulge=0.0)
    one, two = (indent([Probe(Circle(0.012), 0, 0, f)], stiff, POINTS) for f in (1.0, 2.0))
    assert pytest.approx(4 * one[:3].T, abs=1e-15) == two[:3].T
    assert one[:3].T[:, :2].max() > 1e-4


def test_a_curved_face_blends_close_to_what_it_solves():
    at = 0.5 * (1.0 + math.sqrt(2)) * 1e-3 * 2**9  # between two rungs
    read = indent([Probe(Finger(), 0, 0, at)], LINEAR, POINTS)
    dent = solved_dent(Finger(), LINEAR, at, 0.0)
    depth = dent.table[3].reshape(dent.grid.n, -1)
    assert read[3].max() == pytest.approx(depth.max(), rel=0.01)


def test_it_is_read_between_the_nodes_of_its_grid():
    """Three presses, one turned, against scipy's interpolation of each dent by itself."""
    probes = [
        Probe(Circle(0.012), 0.01, 0.02, 1.0),
        Probe(Circle(0.012), -0.03, 0.0, 1.0),
        Probe(Square(0.02), 0.02, -0.01, 1.0, angle=0.7),
    ]
    depth, mean = np.zeros((2, len(POINTS)))
    for probe in probes:
        dent = solved_dent(probe.shape, LINEAR, 1.0, 0.0)
        c, s = math.cos(probe.angle), math.sin(probe.angle)
        off = (POINTS - [probe.x, probe.y]) @ np.array([[c, -s], [s, c]])
        inside = np.linalg.norm(off, axis=1) < dent.grid.reach
        place = (off / dent.grid.step + dent.grid.n // 2).T
        field = dent.table.reshape(-1, dent.grid.n, dent.grid.n)
        trace = field[0] + field[1] + field[4] + field[5]
        depth += inside * map_coordinates(field[3], place, order=1)
        mean += inside * map_coordinates(trace, place, order=1)
    load = indent(probes, LINEAR, POINTS)
    assert load[3] == pytest.approx(depth, abs=1e-15)
    assert load[:3].T[:, :2].sum(axis=1) == pytest.approx(mean, abs=1e-15)


def test_a_body_that_locks_gives_way_less_and_never_beyond():
    light, hard = (indent([Probe(Circle(0.012), 0, 0, f)], FOAM, POINTS) for f in (0.01, 1e4))
    free = indent([Probe(Circle(0.012), 0, 0, 0.01)], LINEAR, POINTS)
    assert light[3] == pytest.approx(free[3], rel=0.02)
    most = FOAM.lock * FOAM.thickness
    assert 0.99 * most < hard[3].max() <= 1.01 * most


def test_a_wider_probe_of_the_same_force_stretches_more_sheet():
    """The source's figure 5.7, and what the lock was chosen for."""
    stretched = [
        indent([Probe(Circle(r), 0, 0, 5.0)], FOAM, POINTS)[:3].T[:, :2].sum()
        for r in (0.015, 0.018, 0.025)
    ]
    assert stretched == sorted(stretched)


def test_moving_and_turning_the_probe_moves_and_turns_the_load():
    angle = 0.7
    cos, sin = math.cos(angle), math.sin(angle)
    turn = np.array([[cos, -sin], [sin, cos]])
    place = np.array([0.004, -0.002])
    straight = indent([Probe(Finger(), 0, 0, 2.0)], FOAM, POINTS)
    turned = indent([Probe(Finger(), *place.tolist(), 2.0, angle)], FOAM, POINTS @ turn.T + place)
    assert turned[3] == pytest.approx(straight[3], rel=1e-9, abs=1e-12)
    tensor = straight[:3].T[:, [0, 2, 2, 1]].reshape(-1, 2, 2)
    expected = (turn @ tensor @ turn.T).reshape(-1, 4)[:, [0, 3, 1]]
    assert pytest.approx(expected, abs=1e-12) == turned[:3].T


def test_several_probes_add_up():
    probes = [Probe(Circle(0.01), -0.02, 0, 1.0), Probe(Square(0.015), 0.02, 0.01, 2.0, 0.3)]
    both = indent(probes, FOAM, POINTS)
    apart = [indent([probe], FOAM, POINTS) for probe in probes]
    assert both[3] == pytest.approx(apart[0][3] + apart[1][3])
    assert pytest.approx(apart[0][:3].T + apart[1][:3].T) == both[:3].T
    assert indent([], FOAM, POINTS)[3].max() == 0.0


def test_blur_keeps_what_lies_under_it():
    sharp, even = (indent([Probe(Circle(0.01), 0, 0, 1.0)], FOAM, POINTS, b) for b in (0.0, 2e-3))
    assert even[3].sum() == pytest.approx(sharp[3].sum(), rel=5e-3)
    assert np.abs(np.diff(even[3])).max() < np.abs(np.diff(sharp[3])).max()


def test_a_sliding_probe_pushes_the_sheet_together_ahead_and_stretches_it_behind():
    def strain_at(x, probe):
        return indent([probe], replace(FOAM, bulge=0.0), np.array([[x, 0.0]]))[:3].T[0, 0]

    still = Probe(Circle(0.01), 0, 0, 0.5)
    slid = still.moving(1.0, 0.0, FOAM.friction)
    assert strain_at(0.013, slid) < strain_at(0.013, still)
    assert strain_at(-0.013, slid) > strain_at(-0.013, still)
    rolled = still.moving(1.0, 0.0, FOAM.rolling_friction)
    gain = strain_at(-0.013, rolled) - strain_at(-0.013, still)
    assert 0 < gain < 0.1 * (strain_at(-0.013, slid) - strain_at(-0.013, still))


def test_strain_obeys_the_balance_of_a_sheet_on_shear_springs():
    """A traction along x that waves along x: (κ + (λ + 2μ)q²) u = τ."""
    mesh = Grid(64, 1e-3)
    q = 2 * math.pi * 3 / (64 * 1e-3)
    wave = np.sin(q * mesh.points[:, 0]).reshape(64, 64)
    strain = drag_strain(np.stack([100 * wave, 0 * wave]), FOAM, mesh)
    plane = FOAM.stiffness / (1 - FOAM.sheet_poisson**2)
    shift = 100 / (FOAM.shear_spring + plane * q**2)
    along = np.cos(q * mesh.points[:, 0]).reshape(64, 64)
    assert strain[0] == pytest.approx(shift * q * along, abs=1e-12)
    assert np.abs(strain[1:]).max() < 1e-12


def test_a_limp_sheet_keeps_the_slope_strain_and_follows_the_bulge():
    mesh = Grid(64, 1e-3)
    r = np.hypot(*mesh.points.T).reshape(64, 64)
    depth = 1e-3 * np.exp(-((r / 8e-3) ** 2))
    limp = replace(FOAM, stiffness=1e-6)
    slope = np.gradient(depth, 1e-3)
    strain = slope_strain(depth, limp, mesh)
    assert strain[0] == pytest.approx(slope[0] ** 2 / 2, abs=2e-4)
    assert strain[2] == pytest.approx(slope[0] * slope[1] / 2, abs=2e-4)
    bulged = bulge_strain(depth, limp, mesh)
    assert bulged[0] + bulged[1] == pytest.approx(2 * FOAM.bulge * depth / FOAM.thickness, abs=1e-6)


def test_a_stiff_sheet_hardly_strains():
    mesh = Grid(64, 1e-3)
    r = np.hypot(*mesh.points.T).reshape(64, 64)
    depth = 1e-3 * np.exp(-((r / 8e-3) ** 2))
    soft, stiff = (
        np.abs(bulge_strain(depth, replace(FOAM, stiffness=s), mesh)).max() for s in (1.0, 1e5)
    )
    assert stiff < 0.2 * soft
