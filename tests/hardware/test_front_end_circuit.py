"""The Pico's front end: its schematic, its decks and the firmware's pins are of one circuit."""

from __future__ import annotations

import math
import re

import pytest

import bill
import front_end
from circuit import ROOT, Circuit
from spice import DECKS

FIRMWARE = ROOT.parent / "firmware" / "pico" / "pins.h"
PICO = Circuit.read("pico-16")
ELECTRODES = [f"E{number}" for number in range(1, 17)]
UNITS = {"k": 1e3, "n": 1e-9, "p": 1e-12, "u": 1e-6, "": 1.0}
GPIO = dict(zip(range(23), [1, 2, 4, 5, 6, 7, 9, 10, 11, 12, 14, 15, 16, 17], strict=False))
GPIO |= {14: 19, 15: 20, 16: 21, 17: 22, 18: 24, 19: 25, 20: 26, 21: 27, 22: 29, 26: 31}
"""The Pico's pins by the names of the processor's."""

SWITCHED = [*range(19, 27), *range(11, 3, -1)]
READ = [*range(9, 1, -1), *range(23, 15, -1)]
"""Pins of the 16 channels of an ADG1606, and of a CD74HCT4067."""


def net(part: str, pin: int) -> str:
    """The net of a pin, without its sheet."""
    return PICO.net_of[part, str(pin)].rsplit("/", 1)[-1]


def number(value: str) -> float:
    digits = value.split(maxsplit=1)[0].rstrip("knpu")
    return float(digits) * UNITS[value.split(maxsplit=1)[0][len(digits) :]]


def between(letter: str, one: str, other: str) -> list[float]:
    """Values of the resistors or capacitors between two nets."""
    return sorted(
        number(part.value)
        for name, part in PICO.parts.items()
        if re.fullmatch(rf"{letter}\d+", name) and {net(name, 1), net(name, 2)} == {one, other}
    )


def in_deck(deck: str, element: str) -> float:
    text = (DECKS / f"{deck}.cir").read_text(encoding="utf-8")
    found = re.search(rf"(?m)^{element} \S+ \S+ (\S+)$", text)
    assert found is not None
    return number(found[1])


def test_no_pin_hangs() -> None:
    """But those of the Pico that are not used, and what a chip does not connect."""
    alone = {name: pins for name, pins in PICO.nets.items() if len(pins) < 2}
    assert all(name.startswith("unconnected-(") for name in alone)
    assert {pins[0][0] for pins in alone.values()} == {"U1", "U2", "U3", "U8", "U11", "U13"}


@pytest.mark.parametrize("deck", ["pico_noise", "pico_settling", "pico_tree"])
@pytest.mark.parametrize(
    ("element", "one", "other"),
    [
        ("R1", "MUX+", "IN+"),
        ("R2", "MUX-", "IN-"),
        ("C1", "IN+", "GND"),
        ("C2", "IN-", "GND"),
        ("R3", "OUT", "ADC"),
        ("C3", "ADC", "GND"),
    ],
)
def test_what_is_read_goes_through_the_filters_of_the_decks(
    deck: str, element: str, one: str, other: str
) -> None:
    assert between(element[0], one, other) == [in_deck(deck, element)]


@pytest.mark.parametrize("deck", ["pico_drive", "pico_dump"])
@pytest.mark.parametrize(
    ("element", "one", "other"), [("R2", "SENSE", "F"), ("C2", "G", "F"), ("R3", "G", "GATE")]
)
def test_the_source_is_that_of_the_decks(deck: str, element: str, one: str, other: str) -> None:
    assert between(element[0], one, other) == [in_deck(deck, element)]


def test_the_dump_is_that_of_the_deck() -> None:
    """The current flows to ground until a source is enabled, and 1.5 us longer."""
    assert (net("U13", 2), net("Q2", 2)) == ("SOURCE_ON", "GND")
    out, gate = net("U13", 4), net("Q2", 1)
    assert (net("D2", 2), net("D2", 1)) == (out, gate)  # it closes at once
    assert between("R", out, gate) == [in_deck("pico_dump", "R7")]
    assert between("R", gate, "GND") == [in_deck("pico_dump", "R8")]
    assert between("R", "BUS", net("Q2", 3)) == [front_end.DUMP]


def test_current_and_gain() -> None:
    """Of parts, of the deck, and of the board's record: one truth."""
    ohms = between("R", "+5V", "SENSE")
    assert ohms == [24.9, 1540.0]
    assert sum(1.225 / one for one in ohms) == pytest.approx(front_end.PICO["current"], rel=1e-3)
    assert 1 / sum(1 / one for one in ohms) == pytest.approx(front_end.SENSE)
    (gain,) = between("R", net("U6", 2), net("U6", 3))
    assert 1 + 49.4e3 / gain == pytest.approx(front_end.GAIN, rel=0.005)


def spread(*parts: tuple[float, float], offset: float = 0.0) -> tuple[float, float]:
    """Least and most of a product of values with relative tolerances, and an offset in V."""
    nominal = math.prod(value for value, _ in parts)
    least = nominal * math.prod(1 - tolerance for _, tolerance in parts) - offset
    most = nominal * math.prod(1 + tolerance for _, tolerance in parts) + offset
    return least, most


OFFSET = 4.5e-3
"""V, of a TLV2371 at most."""


def test_the_page_refuses_no_good_board() -> None:
    """Limits of the first power-up against the tolerances of the parts."""
    text = (ROOT.parent / "docs" / "pico.md").read_text(encoding="utf-8")
    low, high = spread((1.225, 1e-3), offset=OFFSET)
    assert f"{math.floor(1e3 * low) / 1e3} to {math.ceil(1e3 * high) / 1e3} V below" in text
    assert max(high / 1.225 - 1, 1 - low / 1.225) + 1e-3 < 6e-3  # with R1: "within 0.5 %"
    supply = spread((3.3, 2e-3))
    drop = 10 * (3.3 / 20e3 + 0.3e-3)  # of R13: the divider, and U7
    assert supply[0] - drop > 3.28
    assert supply[1] < 3.31
    middle = (supply[0] - drop) * 0.495 - OFFSET, supply[1] * 0.505 + OFFSET
    assert 1.62 < middle[0] < middle[1] < 1.68
    bus = spread((0.05, 6e-3), (22 + 0.03, 1e-2))
    assert 1.07 < bus[0] < bus[1] < 1.13
    least_charge, most_charge = 0.4e-3 * 50, 1.1e-3 * 120  # of U6 and what it drives, through U11
    assert 0 < least_charge < most_charge < 0.15
    for words in ("3.28 to 3.31 V", "1.62 to 1.68 V", "1.07 to 1.13 V", "0 to 0.15 V less"):
        assert words in text


def test_the_converter_divides_by_a_reference_of_its_own() -> None:
    assert PICO.parts["U12"].value == "REF3033"
    assert front_end.PICO["reference"] == 3.3
    assert between("R", net("U12", 2), "+3V3A") == [10.0]
    assert (net("U12", 1), net("U7", 7), net("U7", 1)) == ("+5V", "+3V3A", "+3V3")
    assert max(between("C", "+3V3A", "GND")) == pytest.approx(10e-6)


def test_each_switch_reaches_each_electrode() -> None:
    for switch in ("U2", "U3"):
        assert [net(switch, pin) for pin in SWITCHED] == ELECTRODES
    assert [net("U4", pin) for pin in READ] == ELECTRODES
    assert (net("U2", 28), net("U3", 28), net("U4", 1)) == ("BUS", "GND", "MUX+")


def test_pin_n_of_the_connector_is_electrode_n_behind_a_clamp() -> None:
    assert [net("J1", pin) for pin in range(1, 17)] == ELECTRODES
    assert {net("J1", pin) for pin in range(17, 21)} == {"GND"}
    clamps = [name for name, part in PICO.parts.items() if part.value == "TPD4E05U06"]
    pairs = [(net(name, pin), net(name, 11 - pin)) for name in clamps for pin in (1, 2, 4, 5)]
    assert sorted(pairs) == sorted((one, one) for one in ELECTRODES)
    assert {net(name, pin) for name in clamps for pin in (3, 8)} == {"GND"}


def test_it_reads_against_the_electrode_before_the_sink() -> None:
    """The sink carries the current: against it, a reading would have the sink's contact in it."""
    assert net("U5", 1) == "MUX-"
    assert [net("U5", pin) for pin in (10, 11, 14, 13)] == [
        net("U3", pin) for pin in (17, 16, 15, 14)
    ]
    assert [net("U5", pin) for pin in READ] == [ELECTRODES[n - 1] for n in range(16)]


def test_the_pico_has_them_where_the_firmware_does() -> None:
    text = FIRMWARE.read_text(encoding="utf-8")
    shifts = dict(re.findall(r"#define (\w+)_SHIFT (\d+)u", text))
    inputs = {"SOURCE": ("U2", 17, 16, 15, 14), "SINK": ("U3", 17, 16, 15, 14)}
    inputs["READ"] = ("U4", 10, 11, 14, 13)
    for name, (switch, *pins) in inputs.items():
        first = int(shifts[name])
        assert [net("U1", GPIO[first + bit]) for bit in range(4)] == [
            net(switch, pin) for pin in pins
        ]
    enables = dict(re.findall(r"#define (\w+)_ENABLE \(1u << (\d+)\)", text))
    for name, switch in (("SOURCE", "U2"), ("SINK", "U3")):
        assert net("U1", GPIO[int(enables[name])]) == net(switch, 18)
        assert between("R", net(switch, 18), "GND") == [10e3]  # off until the firmware says
    analogue = re.search(r"#define AMPLIFIER_PIN (\d+)u", text)
    assert analogue is not None
    assert net("U1", GPIO[int(analogue[1])]) == net("U7", 6) == "ADC"


def test_the_committed_bill_is_that_of_the_netlist() -> None:
    committed = (ROOT / "pico-16.csv").read_text(encoding="utf-8")
    assert committed == bill.bill(PICO.parts)
