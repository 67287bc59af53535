"""Pages show the figures of docs/claims.toml, and a claim that no longer holds is named."""

from __future__ import annotations

import datetime
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import claims
from claims import Claim, read, written
from gallery import documented

REPORTS: list[dict[str, Any]] = [
    {
        "title": "presses on the twin",
        "columns": ["skin", "presses", "median mm", "in 90 %"],
        "rows": [["disc-8", 1, 2.61, "84 %"], ["disc-8", 2, 3.5, "1,020 (3)"]],
    },
    {"title": "a plant", "columns": ["skin", "median mm"], "rows": [["disc-8", "–2.0"]]},
]
KEY = "on the twin > disc-8 / 2 → in 90 %"


@pytest.fixture
def claim() -> Claim:
    day = datetime.date(2026, 1, 2)
    return Claim("touch", "one", "tomoskin bench one", day, "abc", {KEY: 1020.0, "b": 2.0})


def test_pages_show_what_the_file_has() -> None:
    """To write them: ``python docs/claims.py --accept`` after a run, or without any claim run."""
    wrong = [page.name for page, text in claims.pages(claims.claims()) if page.read_text() != text]
    assert wrong == []


def test_every_picture_of_the_gallery_has_its_claims_and_says_what_it_assumes() -> None:
    published = {one.name for one in claims.claims() if one.part == "gallery"}
    parts = ("Shown:", "Thesis saw:", "Checked:", "Assumed:")
    texts = documented()
    assert published == texts.keys()
    assert {name for name, text in texts.items() if any(p not in text for p in parts)} == set()


def test_the_file_is_as_it_is_written() -> None:
    assert claims.FILE.read_text(encoding="utf-8") == claims.dumped(claims.claims())


def test_a_number_is_read_by_title_row_and_column() -> None:
    assert read(REPORTS, KEY) == 1020.0
    assert read(REPORTS, "disc-8 / 1 → median mm") == 2.61
    assert read(REPORTS, "disc-9 / 1 → median mm") is None
    assert read({"x": 1.5}, "x") == 1.5


def test_a_claim_that_does_not_hold_is_named(claim: Claim) -> None:
    assert claim.broken({KEY: 1030.0, "b": 2.0}) == []
    assert claim.broken({KEY: 1050.0, "b": 2.0}) == [
        f"one, {KEY}: 1020 is published, 1050.0 was found"
    ]
    assert len(claim.broken({"b": 2.0})) == 1
    assert claim.broken({}) == ["one: tomoskin bench one failed"]


def test_a_table_on_a_page_is_held_against_a_run_number_by_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- bench one -->\n<!-- end one -->\nafter\n", encoding="utf-8")
    monkeypatch.setattr(claims, "ROOT", tmp_path)
    table = Claim(
        "tables", "one", "tomoskin bench one", datetime.date(2026, 1, 2), "abc", page=page.name
    )
    run = [{**one, "notes": ["a note"], "machine": {"cores": "1"}} for one in REPORTS]
    claims.REPORT.Part.of(page, "one").write([claims.REPORT.Report(**one) for one in run])
    published = replace(table, values=claims.numbers(claims.on_page(table)))
    assert published.broken(claims.numbers(run)) == []
    assert len(published.values) == 8
    run[1]["rows"] = [["disc-8", "–2.1"], ["disc-9", 3]]
    wrong = published.broken(claims.numbers(run))
    assert wrong == [
        "one, A plant > disc-9 (2) → median mm, 1: is not published",
        "one, A plant > disc-8 (1) → median mm, 1: 2 is published, 2.1 was found",
    ]


def test_a_time_holds_within_a_factor_of_three_whatever_its_sign() -> None:
    today = datetime.date(2026, 1, 2)
    keys = {"A > b (1) → off, 1": -10.0, "A > b → ms": 2.0}
    timed = Claim("tables", "one", "tomoskin bench one", today, "abc", keys, timed=("off", "ms"))
    assert timed.broken({"A > b (1) → off, 1": -10.0, "A > b → ms": 5.0}) == []
    wrong = timed.broken({"A > b (1) → off, 1": 10.0, "A > b → ms": 7.0})
    assert [one.split(":")[0] for one in wrong] == [f"one, {key}" for key in keys]
    tails = replace(timed, timed=(), tails=("off", "ms"))
    assert tails.broken({"A > b (1) → off, 1": -90.0, "A > b → ms": 0.3}) == []
    wrong = tails.broken({"A > b (1) → off, 1": -110.0, "A > b → ms": 0.1})
    assert [one.split(":")[0] for one in wrong] == [f"one, {key}" for key in keys]


def test_a_figure_on_a_page_is_replaced_where_its_words_stand(claim: Claim) -> None:
    text = "of 3 rows\n1,019 are in, and 2.4 mm; of 3"
    template = f"of 3 rows {{{KEY}|0}} are in, and {{b|1}} mm"
    assert written(text, template, claim.values) == "of 3 rows\n1,020 are in, and 2.0 mm; of 3"
    with pytest.raises(ValueError, match="0 places say"):
        written("something else", template, claim.values)


def test_what_is_found_is_published_only_when_that_is_asked_for(
    claim: Claim, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "claims.toml"
    monkeypatch.setattr(claims, "FILE", file)
    monkeypatch.setattr(claims, "KEPT", tmp_path / "kept")
    monkeypatch.setattr(claims, "pages", lambda _: iter(()))
    monkeypatch.setattr(claims, "measured", lambda _: {KEY: 900.0, "b": 2.0})
    other = replace(claim, part="learning", name="two")
    file.write_text(claims.dumped([claim, other]), encoding="utf-8")
    assert len(list(claims.run([claim, other], "touch", accept=False))) == 1
    assert [one.values[KEY] for one in claims.claims()] == [1020.0, 1020.0]
    assert list(claims.run([claim, other], "touch", accept=True)) == []
    assert [one.values[KEY] for one in claims.claims()] == [900.0, 1020.0]
