"""The Pico's front end: schematic, bill, decks and the firmware's pins are of one circuit."""

from __future__ import annotations

import re
import tomllib
from collections import Counter

import pytest

import front_end
import front_end_drawing
from spice import DECKS

FIRMWARE = front_end.PARTS.parents[1] / "firmware" / "pico" / "pins.h"
PARTS = front_end_drawing.parts()
NETS = front_end_drawing.nets()
LOOSE = "resistors and capacitors"
ELECTRODES = [f"E{number}" for number in range(1, 17)]
UNITS = {"k": 1e3, "n": 1e-9, "p": 1e-12, "u": 1e-6, "": 1.0}


def number(value: str) -> float:
    digits = value.rstrip("knpu")
    return float(digits) * UNITS[value[len(digits) :]]


def between(letter: str, one: str, other: str) -> list[float]:
    """Values of the resistors or capacitors between two nets."""
    return sorted(
        number(part["value"])
        for reference, part in PARTS.items()
        if reference[0] == letter and set(part.get("nets", ())) == {one, other}
    )


def of(part: str) -> list[dict[str, str]]:
    """Net of each pin of each part of that number."""
    return [front_end_drawing.pins(p) for p in PARTS.values() if p.get("part") == part]


def test_the_bill_is_of_its_parts() -> None:
    found = Counter(part.get("part", LOOSE) for part in PARTS.values())
    table = tomllib.loads(front_end.PARTS.read_text(encoding="utf-8"))["part"]
    assert found == {name: row["count"] for name, row in table.items() if row["count"]}


def test_no_pin_hangs() -> None:
    alone = {net: pins for net, pins in NETS.items() if len(pins) < 2}
    assert alone == {}


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


@pytest.mark.parametrize(
    ("element", "one", "other"), [("R2", "SENSE", "F"), ("C2", "G", "F"), ("R3", "G", "GATE")]
)
def test_the_source_is_that_of_the_deck(element: str, one: str, other: str) -> None:
    assert between(element[0], one, other) == [in_deck("pico_drive", element)]


def in_deck(deck: str, element: str) -> float:
    text = (DECKS / f"{deck}.cir").read_text(encoding="utf-8")
    found = re.search(rf"(?m)^{element} \S+ \S+ (\S+)$", text)
    assert found is not None
    return number(found[1])


def test_current_and_gain() -> None:
    """Of parts, of the deck, and of the board's record: one truth."""
    amperes = sum(1.225 / ohms for ohms in (24.9, 1540.0))
    assert amperes == pytest.approx(front_end.PICO["current"], rel=1e-3)
    (pico,) = of("Raspberry Pi Pico")
    assert pico["3V3"] == "+3V3"
    assert front_end.PICO["reference"] == 3.3
    assert between("R", "+5V", "SENSE") == [24.9, 1540.0]
    assert 1 / sum(1 / ohms for ohms in (24.9, 1540.0)) == pytest.approx(front_end.SENSE)
    (ohms,) = between("R", "RG1", "RG2")
    assert 1 + 49.4e3 / ohms == pytest.approx(front_end.GAIN, rel=0.005)


def test_each_switch_reaches_each_electrode() -> None:
    source, sink = of("ADG1606BRUZ")
    read, _ = of("CD74HCT4067M96")
    for switch in (source, sink):
        assert [switch[f"S{number}"] for number in range(1, 17)] == ELECTRODES
    assert [read[f"I{number}"] for number in range(16)] == ELECTRODES
    assert (source["D"], sink["D"], read["COM"]) == ("BUS", "GND", "MUX+")
    (header,) = of("61301621121")
    assert list(header.values()) == ELECTRODES


def test_it_reads_against_the_electrode_before_the_sink() -> None:
    """The sink carries the current: against it, a reading would have the sink's contact in it."""
    _, sink = of("ADG1606BRUZ")
    _, against = of("CD74HCT4067M96")
    assert against["COM"] == "MUX-"
    assert [against[f"S{bit}"] for bit in range(4)] == [sink[f"A{bit}"] for bit in range(4)]
    for address in range(16):
        assert sink[f"S{address + 1}"] == ELECTRODES[address]
        assert against[f"I{address}"] == ELECTRODES[address - 1]


def test_the_pico_has_them_where_the_firmware_does() -> None:
    (pico,) = of("Raspberry Pi Pico")
    text = FIRMWARE.read_text(encoding="utf-8")
    enables = dict(re.findall(r"#define (\w+)_ENABLE \(1u << (\d+)\)", text))
    source, sink = of("ADG1606BRUZ")
    read, _ = of("CD74HCT4067M96")
    shifts = dict(re.findall(r"#define (\w+)_SHIFT (\d+)u", text))
    for name, switch, pin in (("SOURCE", source, "A"), ("SINK", sink, "A"), ("READ", read, "S")):
        first = int(shifts[name])
        assert [pico[f"GP{first + bit}"] for bit in range(4)] == [
            switch[f"{pin}{bit}"] for bit in range(4)
        ]
    assert pico[f"GP{enables['SOURCE']}"] == source["EN"]
    assert pico[f"GP{enables['SINK']}"] == sink["EN"]
    for enable in (source["EN"], sink["EN"]):
        assert between("R", enable, "GND") == [10e3]  # off until the firmware says otherwise
    analogue = re.search(r"#define AMPLIFIER_PIN (\d+)u", text)
    assert analogue is not None
    (converter,) = of("ADS7042IDCUR")
    assert pico[f"GP{analogue[1]}"] == converter["AINP"] == "ADC"


def test_the_drawing_is_of_this_circuit() -> None:
    drawing = front_end_drawing.DRAWING.read_text(encoding="utf-8")
    assert drawing == front_end_drawing.drawn(), "run hardware/front_end_drawing.py"
