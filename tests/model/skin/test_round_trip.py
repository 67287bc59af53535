"""Writing a skin, changing it, and its identity."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from doc_tables import examples
from tomoskin.core import SkinError
from tomoskin.model.skin import Skin


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


def test_a_section_of_the_sheet_is_read_only_when_it_changes() -> None:
    skin = Skin.load("textile-disc-8")
    tuned = skin.altered({"inverse": {"alpha": 0.1}, "touch": {"gamma1": 0.7}})
    assert (tuned.inverse.alpha, tuned.touch.gamma1) == (0.1, 0.7)
    assert tuned.outline is skin.outline
    assert tuned.pattern() is skin.pattern()
    assert tuned.signal is skin.signal
    assert skin.altered({"electrodes": {"width": "9 mm"}}).arcs != skin.arcs


def test_example_of_the_page_is_a_skin() -> None:
    assert Skin.from_toml(examples("skin-file.md")[0]).n_electrodes == 8
