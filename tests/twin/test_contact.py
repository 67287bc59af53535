"""Dents against closed forms, the balance of forces and that of energy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from tomoskin.core import GeometryError, ModelError
from tomoskin.twin import Circle, ContactSettings, Face, Finger, Grid, Probe, Square, solve_contact
from twin.closed_forms import (
    BallOnSprings,
    even_pressure_depth,
    flat_punch_stiffness,
    force_on_a_layer,
)

FOAM = ContactSettings()
GEL = ContactSettings(
    foundation="layer", modulus=1e5, thickness=5e-3, poisson=0.5, tension=0.0, stiffness=0.0
)
SHAPES = (
    Circle(0.012),
    Circle(0.012, 0.02),
    Square(0.02),
    Square(0.02, 0.05),
    Finger(),
    Face(((-0.01, -0.01), (0.014, -0.008), (0.002, 0.003), (0.0, 0.015))),
)


def grid(n=96, half=0.045):
    return Grid(n, 2 * half / n)


def carried(dented):
    return dented.pressure.sum() * dented.grid.step**2


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_forces_balance_and_faces_are_rigid(shape):
    probe = Probe(shape, 0.004, -0.003, 3.0, 0.4)
    dented = solve_contact([probe], FOAM, grid())
    assert carried(dented) == pytest.approx(3.0, rel=1e-9)
    # the springs bear what the faces press: the membrane only hands it on
    assert FOAM.spring * dented.depth.sum() * dented.grid.step**2 == pytest.approx(3.0, rel=1e-6)
    assert dented.pressure.min() >= 0
    cos, sin = math.cos(0.4), math.sin(0.4)
    local = (dented.grid.points - (0.004, -0.003)) @ [[cos, -sin], [sin, cos]]
    gap = shape.gap(local).reshape(dented.depth.shape)
    off = dented.depth - (dented.travel[0] - gap)
    pressing = dented.pressure > 0
    assert np.abs(off[pressing]).max() < 2e-3 * dented.travel[0]
    assert off[np.isfinite(gap)].min() > -2e-3 * dented.travel[0]


def test_a_flat_punch_without_tension_is_a_spring():
    free = replace(FOAM, tension=0.0)
    dented = solve_contact([Probe(Square(0.02), 0, 0, 3.0)], free, Grid(64, 0.02 / 21))
    assert dented.travel[0] == pytest.approx(3.0 / (free.spring * 0.02**2), rel=1e-9)


@pytest.mark.parametrize("radius", [0.006, 0.015])
def test_a_flat_punch_on_a_membrane(radius):
    errors = []
    for n in (64, 192):
        found = solve_contact([Probe(Circle(radius), 0, 0, 3.0)], FOAM, grid(n, radius + 0.036))
        errors.append(abs(found.travel[0] * flat_punch_stiffness(radius, FOAM) / 3.0 - 1))
    assert errors[-1] < 0.02  # the jagged rim of the grid's circle
    assert errors[-1] < errors[0]


def test_the_membrane_under_an_even_pressure():
    """The compliance alone: the pressure is given, no contact is sought."""
    from tomoskin.twin.contact import _compliance

    mesh = grid(256, 0.06)
    r = np.hypot(*mesh.points.T)
    inside = (r < 0.015).reshape(mesh.n, mesh.n)
    pressure = inside * 3.0 / (inside.sum() * mesh.step**2)
    found = _compliance(FOAM, mesh)(pressure).ravel()
    exact = even_pressure_depth(3.0, 0.015, FOAM, np.maximum(r, 1e-9))
    assert np.abs(found - exact).max() < 0.01 * exact.max()


def test_a_ball_on_a_membrane():
    def off(contact):
        return BallOnSprings(0.02, contact, FOAM).force - 1.0

    exact = BallOnSprings(0.02, brentq(off, 1e-4, 0.02), FOAM)
    found = solve_contact([Probe(Circle(0.015, 0.02), 0, 0, 1.0)], FOAM, grid(160, 0.05))
    assert exact.contact < 0.014  # within the face
    assert found.travel[0] == pytest.approx(exact.travel, rel=0.01)
    reach = math.sqrt((found.pressure > 0).sum() * found.grid.step**2 / math.pi)
    assert reach == pytest.approx(exact.contact, rel=0.05)


@pytest.mark.parametrize("thickness", [0.004, 0.005, 0.01, 0.03])
@pytest.mark.parametrize("force", [0.05, 0.5])
def test_a_ball_on_a_layer_glued_to_its_base(thickness, force):
    """From a layer as thin as the contact is wide to Hertz's half-space."""
    body = replace(GEL, thickness=thickness)
    half = 0.012 + 2.5 * thickness
    found = solve_contact([Probe(Circle(0.009, 0.01), 0, 0, force)], body, Grid(192, half / 96))
    exact = force_on_a_layer(0.01, float(found.travel[0]), body)
    assert exact == pytest.approx(force, rel=0.03)
    assert carried(found) == pytest.approx(force, rel=1e-9)


def test_a_wide_punch_squeezes_a_thin_layer_sideways_too():
    """Johnson 1985, section 5.8: p = (1 − ν)E w/(1 + ν)(1 − 2ν)t, far from the rim."""
    nu = 0.3
    body = replace(GEL, poisson=nu, thickness=5e-4)
    found = solve_contact([Probe(Circle(0.02), 0, 0, 5.0)], body, Grid(192, 0.05 / 192))
    stiff = (1 - nu) * body.modulus / ((1 + nu) * (1 - 2 * nu) * body.thickness)
    middle = found.pressure[96, 96] / found.travel[0]
    assert middle == pytest.approx(stiff, rel=0.03)


def test_a_sheet_that_slips_leaves_the_face_of_a_layer_alone():
    stiff = replace(GEL, poisson=0.3, stiffness=1e3)
    slips, sticks = (
        solve_contact([Probe(Circle(0.005), 0, 0, 0.2)], replace(stiff, grip=grip), grid(96, 0.03))
        for grip in (0.0, 1.0)
    )
    free = solve_contact(
        [Probe(Circle(0.005), 0, 0, 0.2)], replace(stiff, stiffness=0.0), grid(96, 0.03)
    )
    assert slips.travel[0] == pytest.approx(free.travel[0])
    assert sticks.travel[0] < 0.999 * free.travel[0]


@pytest.mark.parametrize(
    ("shape", "settings", "half"),
    [(Circle(0.012, 0.02), FOAM, 0.045), (Circle(0.01, 0.02), GEL, 0.012)],
)
def test_the_work_of_the_force_is_the_stored_energy(shape, settings, half):
    forces = np.linspace(0.0, 1.0, 33)[1:] ** 1.5
    path = [solve_contact([Probe(shape, 0, 0, f)], settings, grid(64, half)) for f in forces]
    travel = np.array([0.0, *(step.travel[0] for step in path)])
    force = np.array([0.0, *forces])
    work = float((np.diff(travel) * (force[1:] + force[:-1]) / 2).sum())
    assert path[-1].stored == pytest.approx(work, rel=0.01)
    assert path[-1].stored < 0.9 * force[-1] * travel[-1]


def test_the_stored_energy_is_that_of_springs_and_membrane():
    dented = solve_contact([Probe(Finger(), 0, 0, 2.0)], FOAM, grid(128))
    qx, qy = dented.grid.wave_numbers
    waves = np.fft.rfft2(dented.depth)
    slopes = [np.fft.irfft2(1j * q * waves, dented.depth.shape) for q in (qx, qy)]
    density = FOAM.spring * dented.depth**2 + FOAM.tension * sum(s**2 for s in slopes)
    assert dented.stored == pytest.approx(density.sum() * dented.grid.step**2 / 2, rel=1e-3)


def test_two_probes_hold_each_its_force_and_far_ones_do_not_feel_each_other():
    def pair(apart):
        probes = [Probe(Circle(0.006), s * apart / 2, 0, f) for s, f in ((-1, 1.0), (1, 3.0))]
        return solve_contact(probes, FOAM, grid(128, 0.06))

    alone = solve_contact([Probe(Circle(0.006), -0.03, 0, 1.0)], FOAM, grid(128, 0.06)).travel[0]
    far, near = pair(0.06), pair(0.016)
    assert far.travel[0] == pytest.approx(alone, rel=0.02)
    assert near.travel[0] > 1.1 * alone
    left = np.hypot(near.grid.points[:, 0] + 0.008, near.grid.points[:, 1]) < 0.0075
    assert near.pressure.ravel()[left].sum() * near.grid.step**2 == pytest.approx(1.0, rel=1e-9)


def test_no_force_no_dent():
    dented = solve_contact([Probe(Circle(0.01), 0, 0, 0.0)], FOAM, grid())
    assert np.abs(dented.depth).max() == 0.0


def test_faces_that_overlap_are_named():
    probes = [Probe(Circle(0.01), x, 0, 1.0) for x in (-0.02, 0.0, 0.005)]
    with pytest.raises(
        GeometryError, match="press 1 and press 2: the faces of the two probes overlap"
    ):
        solve_contact(probes, FOAM, grid())


def test_a_face_between_the_nodes_asks_for_a_finer_grid():
    with pytest.raises(GeometryError, match=r"press 0: its face covers no node.*finer"):
        solve_contact([Probe(Circle(1e-5), 0.0003, 0, 1.0)], FOAM, grid())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"foundation": "bed"}, "foundation"),
        ({"modulus": 0.0}, "modulus above 0"),
        ({"thickness": math.nan}, "thickness above 0"),
        ({"tension": -1.0}, "tension of 0 or more"),
        ({"friction": math.inf}, "friction of 0 or more"),
        ({"lock": 0.0}, "lock above 0"),
        ({"poisson": 0.6}, "poisson of 0.5 or less"),
        ({"grip": -0.1}, "grip of 0 or more"),
    ],
)
def test_impossible_settings(change, said):
    with pytest.raises(ModelError, match=said):
        replace(FOAM, **change)
