"""Source, switches, contacts and shorts: what the channels stand at."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tomoskin.core import ModelError
from tomoskin.twin import ElectronicsSettings, Faults
from tomoskin.twin.circuit import driven, line_potentials, settling, shorted
from tomoskin.twin.faults import check_electrodes

PERFECT = ElectronicsSettings()
DRIVES = np.array([[1, 0], [2, 1], [3, 2], [0, 3]])
STAR = np.diag([1.0, 2.0, 3.0, 4.0])
"""Four legs of 1 to 4 Ω that meet in one point."""


def lines(settings=PERFECT, faults=Faults(), contact=None, resistance=STAR, current=0.1):  # noqa: B008
    extra = np.zeros(4) if contact is None else np.asarray(contact)
    return line_potentials(
        resistance, DRIVES, current, contact=extra, faults=faults, settings=settings
    )


def test_ohms_law():
    read = lines().read
    assert read[0] == pytest.approx([0.0, 0.3, 0.1, 0.1])
    assert read[1] == pytest.approx([0.2, 0.0, 0.5, 0.2])


def test_output_resistance_and_compliance_leave_less_current():
    load = np.array([3.0, 100.0])
    soft = replace(PERFECT, output_resistance=300.0)
    assert driven(0.1, load, soft) == pytest.approx([0.1 / 1.01, 0.1 / (4 / 3)])
    weak = replace(PERFECT, compliance=1.0)
    assert driven(0.1, load, weak) == pytest.approx([0.1, 0.01])


def test_contacts_raise_the_sheet_above_the_sink_line_but_no_difference():
    plain, worse = lines().read, lines(contact=[0.5, 0.0, 0.0, 0.0]).read
    assert worse[0, 2] - plain[0, 2] == pytest.approx(0.05)
    assert worse[0, 2] - worse[0, 3] == pytest.approx(plain[0, 2] - plain[0, 3])
    assert worse[0, 0] == 0.0
    assert worse[3, 0] - plain[3, 0] == pytest.approx(0.05)  # now as the source


def test_common_mode_leaks_by_the_rejection():
    settings = replace(PERFECT, switch_resistance=5.0, rejection=40.0)
    plain, leaky = lines(replace(settings, rejection=math.inf)).read, lines(settings).read
    assert plain == pytest.approx(lines().read)  # against the sink line, wherever that is
    common = 0.1 * 5.0 + plain[0, 2] / 2
    assert leaky[0, 2] - plain[0, 2] == pytest.approx(0.01 * common)


def test_neighbours_mix_and_nothing_is_lost():
    plain, mixed = lines().read, lines(replace(PERFECT, crosstalk=0.01)).read
    assert mixed.sum(axis=1) == pytest.approx(plain.sum(axis=1))
    assert mixed[0, 1] == pytest.approx(0.3 + 0.01 * (0.0 + 0.1 - 0.6))


def test_a_short_is_the_circuit_with_a_wire():
    """Legs 2 and 3 joined: a wire of 1 mΩ between their ends carries what they differ by."""
    joined = shorted(STAR, frozenset({(0, 1)}))
    current = np.array([1.0, 0.0, -1.0, 0.0])
    potential = joined @ current
    wire = (potential[0] - potential[1]) / 1e-3
    assert potential == pytest.approx(STAR @ (current + np.array([-wire, wire, 0, 0])))
    assert abs(potential[0] - potential[1]) < 1e-3


def test_a_cut_electrode_floats_and_drives_nothing():
    found = lines(faults=Faults(cut=frozenset({2})))
    assert found.stuck[:, 2].all()
    assert (found.read[1][[0, 1, 3]] == 0).all()  # cut as the source: no current
    assert not found.stuck[1, [0, 1, 3]].any()
    assert found.stuck[2].all()  # cut as the sink: all is drawn up to the supply
    assert found.read[0, 3] == pytest.approx(lines().read[0, 3])
    assert lines(faults=Faults(railed=frozenset({1}))).stuck[:, 1].all()


def test_settling_starts_where_the_drive_before_was_left():
    potentials = np.array([[1.0], [3.0], [-1.0]])
    matrix = settling(np.array([1.0, 2.0, 1.0]), 1.0)
    start = matrix @ np.concatenate([np.zeros((1, 1)), potentials])
    first = 1 - math.exp(-1)
    second = 3 + (first - 3) * math.exp(-2)
    third = -1 + (second + 1) * math.exp(-1)
    assert start[:, 0] == pytest.approx([0.0, first, second, third])
    later = matrix @ np.concatenate([np.full((1, 1), 0.5), potentials])
    assert (later - start)[:, 0] == pytest.approx(0.5 * np.exp([0.0, -1.0, -3.0, -4.0]))


def test_a_fault_of_an_electrode_that_is_not_there():
    with pytest.raises(ModelError, match=r"electrodes from 0 \(E1\) to 7, got 8"):
        check_electrodes(Faults(shorts=frozenset({(0, 8)})), 8)
