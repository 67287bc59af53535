"""The built-in skins: what they state, and where their electrodes are."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tomoskin.core import SkinError, registered
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, Rectangle, quality
from tomoskin.model.skin import Skin

NAMES = ("textile-disc-16", "textile-disc-32", "textile-disc-8", "textile-square-16")


def test_names() -> None:
    assert set(Skin.names()) == {*NAMES, *registered("skins")}


@pytest.mark.parametrize("name", NAMES)
def test_each_one_loads_and_meshes(name: str) -> None:
    skin = Skin.load(name)
    assert (skin.name, skin.source) == (name, "built-in")
    assert skin.description
    mesh = skin.mesh()
    assert mesh is skin.mesh()
    assert len(mesh.cells) == pytest.approx(skin.mesh_cells, rel=0.1)
    assert len(mesh.electrodes) == skin.n_electrodes == skin.pattern().n_electrodes
    assert quality(mesh).minimum > 0.5
    assert skin.contact_impedance.shape == (skin.n_electrodes,)
    assert not skin.contact_impedance.flags.writeable


@pytest.mark.parametrize("name", NAMES)
def test_no_sample_stands_at_a_rail(name: str) -> None:
    """With the sink at ground, the other electrodes use a good part of the converter."""
    skin = Skin.load(name)
    model = ForwardModel(
        skin.mesh(),
        skin.pattern(),
        contact_impedance=skin.contact_impedance,
        current=skin.current,
    )
    potential = model.solve(np.full(len(skin.mesh().cells), skin.conductivity))
    drives = skin.pattern().drives
    rows = np.arange(len(drives))
    above_ground = (
        potential.electrode_potentials - potential.electrode_potentials[rows, drives[:, 1]][:, None]
    )
    read = np.ones(above_ground.shape, dtype=bool)
    read[rows[:, None], drives] = False
    volts = skin.readout.gain * above_ground[read] + skin.readout.offset
    full = skin.readout.reference_voltage
    assert 0.4 * full < volts.max() < 0.95 * full
    assert volts.min() > 0.05 * full


def test_textile_disc_of_the_source() -> None:
    skin = Skin.load("textile-disc-8")
    assert skin.outline == Disc(0.1)
    assert skin.conductivity == pytest.approx(1 / 0.8)
    assert skin.current == pytest.approx(0.1)
    assert skin.contact_impedance == pytest.approx(np.full(8, 2e-4))
    assert skin.mesh_cells == 660
    assert skin.pattern().n_drive == 8
    assert skin.inverse.difference == "plain"
    assert skin.touch.sign == "decrease"
    readout = skin.readout
    assert (readout.adc_bits, readout.oversampling) == (10, 16)
    assert (readout.reference_voltage, readout.offset) == (5.0, 0.0)
    assert readout.settling == pytest.approx(2e-3)
    assert readout.tick_rate == pytest.approx(250e3)


@pytest.mark.parametrize("name", [n for n in NAMES if "square" not in n])
def test_disc_electrodes_start_at_the_top_and_run_clockwise(name: str) -> None:
    skin = Skin.load(name)
    n, radius = skin.n_electrodes, skin.outline.length / (2 * math.pi)
    angle = math.pi / 2 - 2 * math.pi * np.arange(n) / n
    expected = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    assert skin.electrode_centres == pytest.approx(expected, abs=1e-12)


def test_square_has_four_electrodes_a_side_and_none_on_a_corner() -> None:
    skin = Skin.load("textile-square-16")
    assert isinstance(skin.outline, Rectangle)
    x = [-37.5, -12.5, 12.5, 37.5]
    top = [(v, 50.0) for v in x]
    right = [(50.0, -v) for v in x]
    below = [(-v, -50.0) for v in x]
    left = [(-50.0, v) for v in x]
    expected = np.array(top + right + below + left) / 1e3
    assert skin.electrode_centres == pytest.approx(expected, abs=1e-9)


def test_identities_differ_and_last() -> None:
    identities = {Skin.load(name).identity for name in NAMES}
    assert len(identities) == len(NAMES)
    assert Skin.load(NAMES[0]).identity == Skin.load(NAMES[0]).identity


def test_unknown_name_lists_the_built_in_skins() -> None:
    with pytest.raises(SkinError, match='did you mean "textile-disc-8"') as caught:
        Skin.load("textile-disk-8")
    for name in NAMES:
        assert name in caught.value.hint
