"""The copper of the layouts: what it resists, holds and how warm it becomes; distances."""

import json
import math
import re

import pytest

import parasitics
from copper import ROOT, Copper, Pad, Track, heating
from stackup import LAYERS

WIDE = LAYERS["F.Cu"]
KICAD = ROOT / "kicad"


def pad(name, x, y):
    return Pad((name, "1"), "N", (x, y), (0.5, 0.5), 0.0, frozenset({"F.Cu"}))


def ladder(*tracks, vias=()):
    pads = [pad("A", 0, 0), pad("B", 10, 0), pad("C", 5, 5)]
    return Copper(list(tracks), list(vias), {one.name: one for one in pads}, [])


def along(*ends, layer="F.Cu"):
    return Track("N", layer, ends[:2], ends[2:], 0.5)


def test_a_track_has_the_resistance_of_its_squares():
    ohms = ladder(along(0, 0, 10, 0)).potentials(("A", "1"), ("B", "1"))
    assert ohms == pytest.approx([1.72e-8 / 35e-6 * 20], rel=1e-3)


def test_a_branch_has_the_potential_of_where_it_leaves():
    copper = ladder(along(0, 0, 10, 0), along(5, 0, 5, 5))
    whole, half = copper.potentials(("A", "1"), ("B", "1"), ("C", "1"))
    assert half == pytest.approx(whole / 2, rel=1e-3)


def test_a_via_joins_layers_and_a_gap_is_found():
    parts = (along(0, 0, 5, 0), along(5, 0, 10, 0, layer="B.Cu"))
    joined = ladder(*parts, vias=[("N", (5, 0))])
    copper = Copper(joined.tracks, joined.vias, joined.pads, [])
    copper.pads["B", "1"] = Pad(("B", "1"), "N", (10, 0), (0.5, 0.5), 0.0, frozenset())
    (ohms,) = copper.potentials(("A", "1"), ("B", "1"))
    assert ohms == pytest.approx(1.72e-8 / 35e-6 * 20 + 1.46e-3, rel=0.02)
    with pytest.raises(ValueError, match="not joined"):
        Copper(list(parts), [], copper.pads, []).potentials(("A", "1"), ("B", "1"))


def test_capacitance_is_that_of_plates_where_a_track_is_wide():
    plates = 8.854e-12 * WIDE.permittivity * 100e-3 / (WIDE.height * 1e-3)
    assert WIDE.per_metre(100) == pytest.approx(plates, rel=0.02)
    impedance = math.sqrt(3.3) / (299.8e6 * WIDE.per_metre(0.4))  # 50 ohm: 0.4 mm over 0.21 mm
    assert impedance == pytest.approx(50, rel=0.05)


def test_heating_is_that_of_the_standards_chart():
    """IPC-2221: 0.25 mm of 35 µm outside carries 0.87 A for 10 K."""
    assert heating(0.87, 0.25, WIDE) == pytest.approx(10, rel=0.15)


@pytest.mark.parametrize("channels", [8, 16])
def test_no_track_becomes_warm(channels):
    kelvins = parasitics.warmest(channels)
    assert max(kelvins.values()) < 10
    assert kelvins["EL"] < 1


def test_conductors_are_further_apart_than_their_voltage_asks():
    """The rule checks hold the clearance; on a flat board without slots creepage is the same."""
    clamped = 24.4  # V, SMAJ15A at its peak current
    most = max(clamped, *parasitics.VOLTS.values()) - min(parasitics.VOLTS.values())
    for channels in parasitics.BOARDS:
        project = json.loads((KICAD / f"board-{channels}.kicad_pro").read_text(encoding="utf-8"))
        (rules,) = project["net_settings"]["classes"]
        assert rules["clearance"] >= 2 * parasitics.spacing(most)
        assert project["board"]["design_settings"]["rule_severities"]["clearance"] == "error"


def test_the_stack_up_is_in_the_boards():
    for channels in parasitics.BOARDS:
        text = (KICAD / f"board-{channels}.kicad_pcb").read_text(encoding="utf-8")
        of_copper = dict(
            re.findall(r'\(layer "(\S+)"\s+\(type "copper"\)\s+\(thickness ([^)]+)\)', text)
        )
        assert of_copper == {name: str(layer.thickness) for name, layer in LAYERS.items()}
        prepreg = (
            r'\(type "prepreg"\)\s+\(thickness ([^)]+)\)\s+\(material "FR4"\)\s+'
            r"\(epsilon_r ([^)]+)\)"
        )
        found = {(float(a), float(b)) for a, b in re.findall(prepreg, text)}
        assert found == {(layer.height, layer.permittivity) for layer in LAYERS.values()}


PICO = Copper.read(KICAD / "pico-16.kicad_pcb")


def test_the_picos_lines_resist_less_than_contacts():
    """From each electrode's pin to the switch of the source, and to that of the sink."""
    channels = [*range(19, 27), *range(11, 3, -1)]
    for number, channel in enumerate(channels, start=1):
        for switch in ("U2", "U3"):
            (ohms,) = PICO.potentials(("J1", str(number)), (switch, str(channel)))
            assert ohms < 0.25


def test_the_picos_tracks_change_its_current_by_less_than_its_parts_may():
    """What 50 mA lose from reference to sense resistor, and from this to where it is read."""
    _, above = PICO.potentials(("U1", "40"), ("R1", "1"), ("U8", "1"))
    whole, part = PICO.potentials(("R1", "2"), ("Q1", "2"), ("R3", "1"))
    assert (abs(above) + whole - part) * 0.05 / 1.225 < 2e-3


def test_the_picos_distances_and_heat_have_room():
    project = json.loads((KICAD / "pico-16.kicad_pro").read_text(encoding="utf-8"))
    (rules,) = project["net_settings"]["classes"]
    assert rules["clearance"] >= parasitics.spacing(10)  # from -5 V to 5 V
    assert project["board"]["design_settings"]["rule_severities"]["clearance"] == "error"
    width, layer = PICO.narrowest()["E1"]
    assert heating(0.05, width, LAYERS[layer]) < 1
