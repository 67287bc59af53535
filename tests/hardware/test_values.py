"""Schematic and decks describe one board: the same values, block by block."""

import re

import pytest

import results
from circuit import Circuit
from spice import DECKS

TEXT = (DECKS / "circuits.lib").read_text(encoding="utf-8")
BOARD = Circuit.read("board-8")
GND, TWELVE = ("GND", ""), ("+12V", "")


def in_deck(block, element):
    """The value of an element of a block of the decks, by its nodes' line."""
    body = TEXT.split(f".subckt {block} ", 1)[1].split(".ends", 1)[0]
    return re.search(rf"(?m)^{element} \S+ \S+ (\S+)$", body)[1]


@pytest.mark.parametrize(
    ("block", "element", "one", "other"),
    [
        ("CURRENT_mended", "R2", ("Q21", "3"), ("U22", "4")),
        ("CURRENT_mended", "C2", ("U22", "1"), ("U22", "4")),
        ("CURRENT_mended", "R3", ("U22", "1"), ("Q21", "1")),
        ("INPUT_mended", "R2", ("Q1", "2"), ("Q1", "1")),
        ("INPUT_mended", "C6", ("Q1", "2"), ("Q1", "1")),
        ("INPUT_mended", "R3", ("Q1", "1"), ("Q2", "3")),
        ("INPUT_mended", "R4", ("U1", "8"), ("Q2", "1")),
        ("INPUT_mended", "R5", ("Q2", "1"), GND),
        ("DUMP_mended", "R2", ("U23", "4"), ("Q22", "1")),
        ("HIGH_mended", "R1", TWELVE, ("Q302", "1")),
        ("HIGH_mended", "R2", ("U81", "13"), ("Q301", "1")),
        ("HIGH_mended", "R3", ("Q301", "1"), GND),
        ("LOW", "R2", ("U82", "13"), ("Q303", "1")),
        ("LOW", "R3", ("Q303", "1"), GND),
        ("CHAIN", "R1", ("J301", "1"), ("U301", "3")),
        ("CHAIN", "R2", ("J41", "2"), ("U301", "2")),
        ("CHAIN", "C1", ("U301", "3"), GND),
        ("CHAIN", "C2", ("U301", "2"), GND),
        ("CHAIN", "R3", ("U301", "6"), ("C303", "1")),
        ("CHAIN", "C3", ("C303", "1"), GND),
        ("CHAIN", "R4", ("C303", "1"), ("U302", "3")),
        ("CHAIN", "R5", ("U302", "1"), ("J62", "3")),
        ("CHAIN", "C5", ("J62", "3"), GND),
    ],
)
def test_a_value_is_the_same_in_both(block, element, one, other):
    assert BOARD.value(one, other, kinds=element[0]).split()[0] == in_deck(block, element)


def test_what_sets_the_current():
    sense = {"+12V", BOARD.net_of["Q21", "3"]}
    pair = [
        p.value
        for r, p in BOARD.parts.items()
        if r[0] == "R" and {BOARD.net_of[r, n] for n in "12"} == sense
    ]
    of_deck = [float(in_deck("CURRENT_mended", name)[1:].split("/")[0]) for name in ("R1", "R4")]
    ohms = [float(value.rstrip("k")) * (1e3 if "k" in value else 1) for value in pair]
    assert ohms == pytest.approx([value / results.AMPERES for value in of_deck])
    amperes = sum(1.225 / value for value in ohms)
    assert amperes == pytest.approx(results.AMPERES, rel=2e-4)
    assert amperes < results.AMPERES  # what the skin may carry


def test_what_sets_the_gain():
    ohms = float(BOARD.value(("U301", "1"), ("U301", "8")).rstrip("k")) * 1e3
    assert 1 + 50e3 / ohms == pytest.approx(results.GAIN, rel=0.002)
    assert BOARD.value(("Q21", "2"), ("Q22", "3")) == "22"
    decks = [file.read_text(encoding="utf-8") for file in DECKS.glob("*.cir")]
    assert {m for text in decks for m in re.findall(r"rdump=(\d+)", text)} == {"22"}


@pytest.mark.parametrize("pin", ["20", "22", "24"])
def test_a_pull_down_is_that_of_the_deck(pin):
    assert BOARD.value(("J64", pin), GND) == "10k"
