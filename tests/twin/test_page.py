"""The documented numbers are those that run, and each says what it is."""

from pathlib import Path

import pytest

from tomoskin.twin import (
    BendSettings,
    ContactSettings,
    ElectronicsSettings,
    LineSettings,
    MaterialSettings,
)
from tomoskin.twin.page import parameter_tables
from tomoskin.twin.parameters import documented
from tomoskin.twin.settings import SOURCES

PAGE = Path(__file__).resolve().parents[2] / "docs" / "twin.md"
MARK = "<!-- from here on written by tomoskin.twin.page.parameter_tables() -->\n\n"
RECORDS = (ContactSettings, MaterialSettings, ElectronicsSettings, LineSettings, BendSettings)


def test_the_page_holds_the_records_numbers():
    """To write it: the text up to MARK, MARK, then ``parameter_tables()``."""
    _, tables = PAGE.read_text(encoding="utf-8").split(MARK)
    assert tables == parameter_tables()


@pytest.mark.parametrize("record", RECORDS)
def test_every_number_says_what_it_is(record):
    for name, unit, meaning, source in documented(record):
        assert meaning.endswith("."), name
        assert source or isinstance(getattr(record(), name), str), name
        assert unit == unit.strip()


def test_sources_are_of_numbers_that_exist():
    known = {name for record in RECORDS for name, *_ in documented(record)}
    assert set(SOURCES) <= known
