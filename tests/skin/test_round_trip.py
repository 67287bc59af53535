"""Writing a skin, changing it, its identity, and the page that documents the file."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tomoskin.core import SkinError
from tomoskin.skin import Skin, skin_file_page
from tomoskin.skin.page import EXAMPLE
from tomoskin.skin.schema import SECTIONS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "skin-file.md"


@pytest.mark.parametrize("name", Skin.names())
def test_written_skins_are_read_again(name: str) -> None:
    skin = Skin.load(name)
    again = Skin.from_toml(skin.to_toml())
    assert again.to_toml() == skin.to_toml()
    assert again.identity == skin.identity
    assert again.arcs == skin.arcs


@given(st.text(st.characters(codec="utf-8", exclude_characters="\r")))
def test_any_description_survives(text: str) -> None:
    skin = Skin.load("textile-disc-8").altered({"skin": {"description": text}})
    assert Skin.from_toml(skin.to_toml()).description == text


@given(
    cells=st.integers(50, 100_000),
    alpha=st.floats(1e-9, 1e9),
    drive=st.lists(st.permutations(range(8)), min_size=1, max_size=1),
)
def test_any_values_survive(cells: int, alpha: float, drive: list[list[int]]) -> None:
    a, b, c, d = drive[0][:4]
    skin = Skin.load("textile-disc-8").altered(
        {
            "mesh": {"cells": cells},
            "inverse": {"alpha": alpha},
            "drive": {"pattern": None, "drive": [[a, b]], "measure": [[c, d]]},
        }
    )
    again = Skin.from_toml(skin.to_toml())
    assert (again.mesh_cells, again.inverse.alpha) == (cells, alpha)
    assert again.pattern().drive.tolist() == [[a, b]]
    assert again.identity == skin.identity


def test_identity_follows_values_and_not_their_writing() -> None:
    skin = Skin.load("textile-disc-8")
    same = skin.altered({"outline": {"diameter": "20 cm"}, "skin": {"name": "other"}})
    other = skin.altered({"outline": {"diameter": "201 mm"}})
    assert same.identity == skin.identity
    assert other.identity != skin.identity


def test_altered_values_are_checked() -> None:
    skin = Skin.load("textile-disc-8")
    with pytest.raises(SkinError, match="expected a whole number") as caught:
        skin.altered({"mesh": {"cells": 1}})
    assert caught.value.where == "built-in: [mesh] cells"
    with pytest.raises(SkinError, match='unknown section "meshes"'):
        skin.altered({"meshes": {}})


def test_page_is_what_the_schema_says() -> None:
    """To write it: ``Path("docs/skin-file.md").write_text(skin_file_page())``."""
    assert PAGE.read_text(encoding="utf-8") == skin_file_page()


def test_page_lists_every_key_with_its_range() -> None:
    page = skin_file_page()
    for section in SECTIONS:
        assert f"## [{section.name}]" in page
        for key in section.keys:
            assert f"| `{key.name}` | {key.kind.expected} |" in page


def test_example_of_the_page_is_a_skin() -> None:
    assert Skin.from_toml(EXAMPLE).n_electrodes == 8


def test_defaults_are_allowed_values() -> None:
    for section in SECTIONS:
        for key in section.keys:
            if key.default is not None:
                key.kind.read(key.default)
