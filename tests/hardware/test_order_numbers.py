"""Each order number on the bills against its maker's table, or by how much less it was checked."""

import re
import tomllib
from datetime import date
from pathlib import Path

import pytest

import bill
from circuit import ROOT, Circuit

DATA = tomllib.loads(Path(__file__).with_name("order_numbers.toml").read_text(encoding="utf-8"))
PAGES = (ROOT.parent / "docs" / name for name in ("hardware.md", "pico.md"))
PAGE = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
UNITS = {"p": 1.0, "n": 1e3, "u": 1e6, "k": 1e3, "R": 1.0, "K": 1e3, "M": 1e6}


def ordered():
    """Values by the number that is ordered, of all boards."""
    return {
        number: group[0].value.split()[0]
        for board in ("board-8", "board-16", "pico-16")
        for number, group in bill.grouped(Circuit.read(board).parts).items()
    }


VALUES = ordered()


def by_scheme(number):
    """What the maker's scheme says that a number is, in ohm or pF, or nothing."""
    for row in DATA["scheme"].values():
        found = re.fullmatch(row["pattern"], number)
        if found and "ohm" in found.groupdict():
            whole, unit, part = re.fullmatch(r"(\d+)([RKM])(\d*)", found["ohm"]).groups()
            return float(f"{whole}.{part or 0}") * UNITS[unit]
        if found:
            digits = found["picofarad"]
            return float(digits[:2]) * 10 ** int(digits[2])
    return None


def of_schematic(value):
    digits = value.rstrip("pnuk")
    return float(digits) * UNITS.get(value[len(digits) :], 1.0)


@pytest.mark.parametrize("number", VALUES)
def test_a_number_was_checked_in_one_way_and_says_so(number):
    ways = [
        number in DATA["table"],
        by_scheme(number) is not None,
        number in DATA["designs"]["numbers"],
        number in DATA["unread"]["numbers"],
    ]
    assert sum(ways) == 1


@pytest.mark.parametrize("number", [n for n in VALUES if by_scheme(n) is not None])
def test_a_number_of_a_scheme_has_the_value_of_the_schematic(number):
    assert by_scheme(number) == pytest.approx(of_schematic(VALUES[number]))


def test_each_source_has_a_date_and_nothing_is_listed_that_is_not_ordered():
    assert all(isinstance(row["date"], date) for row in DATA["table"].values())
    assert all(isinstance(row["date"], date) for row in DATA["scheme"].values())
    listed = {*DATA["table"], *DATA["designs"]["numbers"], *DATA["unread"]["numbers"]}
    assert listed <= set(VALUES)


def test_a_multiplexer_for_3_volt_logic_is_ordered_as_its_maker_sells_it():
    """TI sells the CD74HCT4067 as CD74HCT4067M alone: what ends in M96 is the CD74HC4067."""
    assert "CD74HCT4067M96" not in VALUES
    assert by_scheme("RC0603FR-073K3L") == 3300.0
    assert by_scheme("RC0603FR-07330RL") == 330.0
    assert by_scheme("CC0603JRNPO9BN331") == 330.0


def test_the_page_says_how_many_were_not_read():
    unread = len(DATA["unread"]["numbers"])
    assert f"{unread} numbers were looked up nowhere" in PAGE


@pytest.mark.parametrize("board", ["board-8", "board-16", "pico-16"])
def test_the_dearest_lines_have_an_alternative_or_the_page_names_them(board):
    known = bill.known()
    groups = bill.grouped(Circuit.read(board).parts)
    dearest = sorted(groups, key=lambda n: len(groups[n]) * known[n].each[0], reverse=True)[:10]
    for number in dearest:
        assert known[number].other or number in PAGE, number
