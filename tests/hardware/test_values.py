"""Schematic and decks describe one board: the same values, block by block."""

import re

import pytest

import results
from schematic.board import assembly
from spice import DECKS

TEXT = (DECKS / "circuits.lib").read_text(encoding="utf-8")
BOARD = assembly(8)


def in_deck(block, element):
    """The value of an element of a block of the decks, by its nodes' line."""
    body = TEXT.split(f".subckt {block} ", 1)[1].split(".ends", 1)[0]
    return re.search(rf"(?m)^{element} \S+ \S+ (\S+)$", body)[1]


def on_board(*nets):
    """The value of the resistor or capacitor between these nets."""
    passive = [part for part in BOARD.placed.values() if part.part.letter in "RC"]
    found = {part.value for part in passive if sorted(part.nets.values()) == sorted(nets)}
    assert len(found) == 1, (nets, found)
    return found.pop()


@pytest.mark.parametrize(
    ("block", "element", "nets"),
    [
        ("CURRENT_mended", "R2", ("SENSE", "BACK")),
        ("CURRENT_mended", "C2", ("DRIVE", "BACK")),
        ("CURRENT_mended", "R3", ("DRIVE", "GATE")),
        ("DUMP_mended", "R2", ("IDLE", "DUMP_GATE")),
        ("HIGH_mended", "R1", ("+12V", "HIGH_3")),
        ("HIGH_mended", "R2", ("SOURCE_3", "SHIFT_3")),
        ("HIGH_mended", "R3", ("SHIFT_3", "GND")),
        ("LOW", "R2", ("SINK_3", "LOW_3")),
        ("LOW", "R3", ("LOW_3", "GND")),
        ("CHAIN", "R1", ("EL_3", "TAP_3")),
        ("CHAIN", "R2", ("MINUS", "NEG_3")),
        ("CHAIN", "C1", ("TAP_3", "GND")),
        ("CHAIN", "R3", ("AMP_3", "FILTER_3")),
        ("CHAIN", "C3", ("FILTER_3", "GND")),
        ("CHAIN", "R4", ("FILTER_3", "CLAMP_3")),
        ("CHAIN", "R5", ("BUFFER_3", "POTENTIAL_3")),
        ("CHAIN", "C5", ("POTENTIAL_3", "GND")),
    ],
)
def test_a_value_is_the_same_in_both(block, element, nets):
    assert on_board(*nets).split()[0] == in_deck(block, element)


def test_what_sets_the_current():
    pair = [p.value for p in BOARD.placed.values() if set(p.nets.values()) == {"+12V", "SENSE"}]
    of_deck = [float(in_deck("CURRENT_mended", name)[1:].split("/")[0]) for name in ("R1", "R4")]
    ohms = [float(value.rstrip("k")) * (1e3 if "k" in value else 1) for value in pair]
    assert ohms == pytest.approx([value / results.AMPERES for value in of_deck])
    amperes = sum(1.225 / value for value in ohms)
    assert amperes == pytest.approx(results.AMPERES, rel=2e-4)
    assert amperes < results.AMPERES  # what the skin may carry


def test_what_sets_the_gain():
    ohms = float(on_board("RA_3", "RB_3").rstrip("k")) * 1e3
    assert 1 + 50e3 / ohms == pytest.approx(results.GAIN, rel=0.002)
    assert on_board("BUS", "DUMP") == "22"
    decks = [file.read_text(encoding="utf-8") for file in DECKS.glob("*.cir")]
    assert {m for text in decks for m in re.findall(r"rdump=(\d+)", text)} == {"22"}


@pytest.mark.parametrize("signal", ["SOURCE_ENABLE_0", "SINK_ENABLE_0", "LATCH_0"])
def test_a_pull_down_is_that_of_the_deck(signal):
    assert on_board(signal, "GND") == "10k"
