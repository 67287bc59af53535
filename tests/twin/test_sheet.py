"""The twin's sheet against the reconstruction's model, and what a press does to it."""

from dataclasses import replace

import numpy as np
import pytest

from oracles import disc_resistance
from tomoskin.core import GeometryError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Scan
from tomoskin.twin import (
    PRESETS,
    Circle,
    ElectronicsSettings,
    Face,
    Faults,
    Finger,
    Press,
    Probe,
    TwinSettings,
    TwinSkin,
)
from tomoskin.twin.circuit import line_potentials


def potentials(sheet, skin, drives):
    """(n_drives, n) V against the sink."""
    perfect, contact = ElectronicsSettings(), np.zeros(skin.n_electrodes)
    lines = line_potentials(
        sheet.resistance(),
        drives,
        skin.current,
        contact=contact,
        faults=Faults(),
        settings=perfect,
    )
    return lines.read


def rows(sheet, skin):
    """(n_meas,) V of the pattern's rows, by way of the samples."""
    scan = Scan.of(skin.pattern())
    volts = potentials(sheet, skin, scan.drives)[scan.sample_drive, scan.sample_electrode]
    assert (volts > 0).all()  # against the grounded sink
    return volts[scan.plus] - volts[scan.minus]


def test_mesh_is_finer_and_another(sheet, skin):
    assert sheet.model.mesh.identity != skin.mesh().identity
    assert len(sheet.model.mesh.cells) > 1.3 * len(skin.mesh().cells)


def test_homogeneous_sheet_agrees_with_the_reconstructions_model(sheet, skin):
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    expected = model.solve(skin.conductivity).voltages
    assert rows(sheet, skin) == pytest.approx(expected, rel=0.02)


def test_potentials_include_the_contacts(sheet, skin):
    model = ForwardModel(sheet.model.mesh, skin.pattern(), skin.contact_impedance, skin.current)
    sol = model.solve(skin.conductivity)
    drive = int(np.flatnonzero((skin.pattern().drives == (1, 0)).all(axis=1))[0])
    expected = sol.electrode_potentials[drive, 4] - sol.electrode_potentials[drive, 0]
    found = potentials(sheet, skin, np.array([[1, 0]]))[0, 4]
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("electrode", [1, 6])
def test_a_press_changes_the_rows_near_it_most(sheet, skin, electrode):
    rest = rows(sheet, skin)
    x, y = 0.8 * skin.electrode_centres[electrode]
    sheet.set_presses((Press(float(x), float(y), 3.0, 0.015),))
    sigma = sheet.conductivity()
    assert sigma.max() <= 1.05 * skin.conductivity
    nearest = np.linalg.norm(sheet.model.mesh.centroids - (x, y), axis=1).argsort()
    assert sigma[nearest[0]] < 0.9 * skin.conductivity
    change = np.abs(rows(sheet, skin) - rest)
    table = np.hstack([skin.pattern().drive, skin.pattern().measure])
    touching = (table == electrode).any(axis=1)
    assert touching[change.argsort()[-3:]].all()
    assert change[touching].mean() > 2 * change[~touching].mean()


def test_nothing_is_solved_again_unless_a_press_changes(sheet):
    before = sheet.solves
    first = sheet.resistance()
    assert sheet.resistance() is first
    sheet.set_presses((Press(0, 0, 1, 0.01),))
    pressed = sheet.resistance()
    sheet.set_presses((Press(0, 0, 1, 0.01),))
    assert sheet.resistance() is pressed
    assert sheet.solves <= before + 2


def test_a_refused_press_changes_nothing(sheet):
    good = (Press(0, 0, 1, 0.01),)
    sheet.set_presses(good)
    with pytest.raises(GeometryError, match="off the skin"):
        sheet.set_presses((Press(1, 0, 1, 0.01),))
    speck = Face(((0.01, 0.01), (0.0101, 0.01), (0.01, 0.0101)))  # between two nodes of its grid
    with pytest.raises(GeometryError, match="covers no node"):
        sheet.set_presses((*good, Probe(speck, 0, 0.03, 1.0)))
    assert sheet.presses == good
    sheet.resistance()


def test_potentials_are_those_of_the_analytic_disc(skin):
    """A twin's own mesh, the default one and one four times as fine, against the series."""
    width = skin.arcs[0].width(skin.outline)
    middle = np.arctan2(skin.electrode_centres[:, 1], skin.electrode_centres[:, 0])
    exact = disc_resistance(0.1, skin.conductivity, middle, width / 0.2, skin.contact_impedance)
    errors = []
    for ratio in (1.6, 6.4):
        sheet = TwinSkin.of(skin, TwinSettings(mesh_ratio=ratio))
        found, expected = map(sheet.model.voltages, (sheet.resistance(), exact))
        errors.append(np.abs(found - expected).max() / np.abs(expected).max())
    assert errors[0] < 0.02
    assert errors[1] < 0.6 * errors[0]


@pytest.mark.parametrize("radius", [0.002, 0.02])
def test_either_way_of_solving_is_exact(sheet, radius):
    sheet.set_presses((Press(0.01, 0.02, 0.5, radius),))
    found = sheet.resistance()
    afresh = sheet.model.transfer_resistance(sheet.conductivity())
    assert found == pytest.approx(afresh, rel=1e-9, abs=1e-12)


def test_few_changed_cells_are_solved_by_the_local_update(skin, monkeypatch):
    """In the tank no tension moves what lies beside the probe."""
    sheet = TwinSkin.of(
        skin, replace(TwinSettings.preset("ideal"), contact=PRESETS["tank"].contact)
    )
    sheet.material = replace(sheet.material, compression=-1.0, gauge=0.0)
    rest = sheet.conductivity()
    exact = sheet.resistance()
    sheet.set_presses((Press(0.01, 0.02, 0.5, 0.002),))
    changed = np.flatnonzero(sheet.conductivity() != rest)
    assert 0 < len(changed) < 0.04 * len(rest)
    asked = []
    monkeypatch.setattr(
        type(sheet._network.base.local),
        "transfer_resistances_of",
        lambda _, touches: asked.extend(touches) or [exact],
    )
    sheet.resistance()
    ((cells, sigma),) = asked
    assert cells.tolist() == changed.tolist()
    assert sigma.tolist() == sheet.conductivity()[changed].tolist()


def test_a_directed_sheet_agrees_with_the_models_own_check(skin):
    sheet = TwinSkin.of(skin, TwinSettings.preset("textile"))
    sheet.set_presses((Probe(Finger(), 0.02, 0.01, 3.0, 0.3),))
    sigma = sheet.conductivity()
    assert sigma.shape == (len(sheet.model.mesh.cells), 2, 2)
    expected = sheet.model.transfer_resistance(sigma)
    assert sheet.resistance() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_is_pressed_and_let_go(skin, name):
    settings = TwinSettings.preset(name)
    still = replace(settings.material, temperature_sd=0.0)
    sheet = TwinSkin.of(skin, replace(settings, material=still))
    rest = sheet.resistance()
    sheet.set_presses((Press(0.03, 0.02, 3.0, 0.012),))
    sheet.advance(1.0)
    pressed = sheet.resistance()
    sheet.set_presses(())
    sheet.advance(1e-6)
    left = np.abs(sheet.resistance() - rest).max()
    change = np.abs(pressed - rest).max()
    assert change > 1e-3 * np.abs(rest).max()
    assert left < 0.2 * change
    assert (left == 0) == (name in {"ideal", "tank"})


def test_a_remainder_after_unloading_of_which_a_part_fades(skin):
    """The source's figure 5.10: something is left when the probe has gone."""
    sheet = TwinSkin.of(skin, TwinSettings.preset("textile"))
    mean = np.trace(sheet.conductivity(), axis1=1, axis2=2)

    def deepest():
        now = np.trace(sheet.conductivity(), axis1=1, axis2=2) / mean
        return float(np.median(now) - now.min())

    sheet.set_presses((Press(0.0, 0.0, 4.0, 0.015),))
    sheet.advance(5.0)
    loaded = deepest()
    sheet.set_presses(())
    sheet.advance(0.1)
    soon = deepest()
    sheet.advance(300.0)
    assert 0.05 < soon / loaded < 0.12
    assert 0.5 * soon < deepest() < 0.95 * soon


def test_the_seed_decides_on_spread_and_temperature(skin):
    def sigma(seed):
        sheet = TwinSkin.of(skin, TwinSettings.preset("textile", seed))
        sheet.advance(10.0)
        return sheet.conductivity()

    assert (sigma(1) == sigma(1)).all()
    assert (sigma(1) != sigma(2)).any()


def test_asking_for_the_load_first_changes_nothing(sheet):
    rest = sheet.conductivity()
    sheet.set_presses((Press(0.01, 0.02, 2.0, 0.01),))
    assert sheet.load[3].max() > 0
    assert sheet.conductivity().min() < 0.95 * rest.min()


def test_a_renewed_sheet_has_forgotten_everything(skin):
    sheet = TwinSkin.of(skin, TwinSettings.preset("hydrogel"))
    rest = sheet.conductivity()
    sheet.set_presses((Probe(Circle(0.01), 0, 0, 3.0),))
    sheet.advance(5.0)
    sheet.renew()
    assert sheet.presses == ()
    assert sheet.conductivity() == pytest.approx(rest)


def test_a_warmer_sheet_conducts_as_its_material_says(skin):
    sheet = TwinSkin.of(skin, TwinSettings.preset("textile"))
    rest = sheet.conductivity()
    sheet.warm(10.0)
    assert sheet.conductivity() == pytest.approx(rest / 1.038)
