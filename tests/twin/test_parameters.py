"""The documented numbers are those that run, and each says what it is."""

import pytest

from doc_tables import documented
from tomoskin.twin import (
    BendSettings,
    ContactSettings,
    ElectronicsSettings,
    LineSettings,
    MaterialSettings,
)
from tomoskin.twin.presets import SOURCES

RECORDS = (ContactSettings, MaterialSettings, ElectronicsSettings, LineSettings, BendSettings)


@pytest.mark.parametrize("record", RECORDS)
def test_every_number_says_what_it_is(record):
    for name, unit, meaning, source in documented(record):
        assert meaning.endswith("."), name
        assert source or isinstance(getattr(record(), name), str), name
        assert unit == unit.strip()


def test_sources_are_of_numbers_that_exist():
    known = {name for record in RECORDS for name, *_ in documented(record)}
    assert set(SOURCES) <= known
