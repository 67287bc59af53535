"""The twin's sheet against the reconstruction's model, and what a press does to it."""

import numpy as np
import pytest

from tomoskin.core import GeometryError
from tomoskin.forward import ForwardModel
from tomoskin.pattern import Scan
from tomoskin.twin import ElectronicsSettings, Faults, Press, line_potentials


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
    assert sheet.presses == good
