"""What a skin asks of the board, against the twin, and whether what is advised fits."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Headroom
from tomoskin.twin.circuit import line_potentials
from tomoskin.twin.faults import Faults
from tomoskin.twin.presets import BOARD

COARSE = {"mesh": {"cells": 400}}


def skin_of(name: str, **changes: dict[str, object]) -> Skin:
    return Skin.load(name).altered({**COARSE, **changes})


@pytest.mark.parametrize("name", Skin.names())
def test_built_in_skins_leave_room(name: str) -> None:
    headroom = Headroom.of_skin(skin_of(name))
    assert headroom.problem is None
    assert headroom.samples.max() < 0.8 * headroom.readable[1]


def test_the_samples_are_those_of_the_circuit() -> None:
    skin = skin_of("textile-disc-8", drive={"pattern": "skip:2"})
    scan = Scan.of(skin.pattern())
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    lines = line_potentials(
        model.transfer_resistance(skin.conductivity),
        scan.drives,
        skin.current,
        contact=np.zeros(8),
        faults=Faults(),
        settings=BOARD,
    )
    expected = lines.read[scan.sample_drive, scan.sample_electrode]
    np.testing.assert_allclose(Headroom.of_skin(skin).samples, expected, rtol=1e-3)


def test_what_is_advised_fits_and_little_more_does_not() -> None:
    skin = skin_of("textile-disc-8", material={"sheet_resistance": "800 ohm/sq"})
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance)
    state = model.at(skin.conductivity)
    headroom = Headroom.of(skin, state)
    assert headroom.saturated.all()
    assert headroom.drive.max() > 100
    found = re.search(
        r"a current of (\S+) mA fits, or (\S+) mA with a gain of (\S+)$", headroom.problem or ""
    )
    assert found, headroom.problem
    alone, most, gain = map(float, found.groups())
    fit = (
        {"drive": {"current": f"{alone} mA"}},
        {
            "drive": {"current": f"{most} mA"},
            "readout": {"gain": gain},
        },
    )
    for changes in fit:
        assert Headroom.of(skin.altered(changes), state).problem is None
    for current, factor in ((1.5 * alone, 1.0), (1.5 * most, 0.1)):
        changes = {"drive": {"current": f"{current} mA"}, "readout": {"gain": 35 * factor}}
        assert Headroom.of(skin.altered(changes), state).problem


def test_a_few_measurements_beyond_the_converter_are_counted() -> None:
    headroom = Headroom.of_skin(skin_of("textile-disc-16", drive={"pattern": "opposite"}))
    assert 0 < np.count_nonzero(headroom.saturated) < len(headroom.saturated) / 2
    assert "or a gain of 2" in (headroom.problem or "")


def test_where_no_current_of_a_file_fits_the_sheet_is_named() -> None:
    skin = skin_of(
        "textile-disc-8",
        material={"sheet_resistance": "1000 kohm/sq"},
        electrodes={"contact_impedance": "200000 ohm*m"},
    )
    assert "lower resistance" in (Headroom.of_skin(skin).problem or "")


def test_an_offset_below_the_converter_is_named() -> None:
    skin = skin_of("textile-disc-8", readout={"offset": "-4 V"})
    assert "use an offset" in (Headroom.of_skin(skin).problem or "")
