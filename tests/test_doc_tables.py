"""The tables of the documentation are those of the declarations that run."""

from __future__ import annotations

import pytest

from doc_tables import FOLDER, PAGES, written
from tomoskin.model.section import Section
from tomoskin.model.skin import SECTIONS
from tomoskin.twin.script_schema import SECTIONS as SCRIPT_SECTIONS


@pytest.mark.parametrize("page", PAGES)
def test_a_page_is_what_the_declarations_say(page: str) -> None:
    """To write them: ``python docs/doc_tables.py``."""
    assert (FOLDER / page).read_text(encoding="utf-8") == written(page)


@pytest.mark.parametrize("section", [*SECTIONS.values(), *SCRIPT_SECTIONS.values()])
def test_every_section_and_key_says_what_it_is(section: type[Section]) -> None:
    assert section.meaning.endswith(".")
    for key in section.keys:
        assert key.meaning.endswith("."), key.name
