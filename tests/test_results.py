"""Figures of docs/results.md, and ours in docs/comparison.md, stand in the tables they name."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from prose import DOCS, ROOT

_NUMBER = re.compile(r"(?<![\w.,⁻·-])\d[\d,]*(?:\.\d+)?(?![\w⁻])")
_LINK = re.compile(r"\]\(([\w-]+\.md)#([\w-]+)\)")
_SPAN = re.compile(r"(?<=\d)( to | and |–)(?=\d)")


def slug(heading: str) -> str:
    """As Sphinx and GitHub make it."""
    return re.sub(r"[^\w\- ]", "", heading.strip("# ").lower()).replace(" ", "-")


def section(page: str, anchor: str) -> str:
    """The text below a heading, with those below it."""
    lines = (DOCS / page).read_text(encoding="utf-8").splitlines()
    at = next(n for n, line in enumerate(lines) if line.startswith("#") and slug(line) == anchor)
    depth = len(lines[at].split(" ")[0])
    end = re.compile(rf"#{{1,{depth}}} ")
    after = (n for n in range(at + 1, len(lines)) if end.match(lines[n]))
    return "\n".join(lines[at + 1 : next(after, len(lines))])


def rows(text: str) -> Iterator[list[str]]:
    """Cells of the rows of a table, without its head."""
    for line in text.splitlines():
        if line.startswith("|"):
            yield [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def numbers(text: str) -> list[str]:
    """As they are written; "1,200" is one."""
    plain = re.sub(r"\]\([^)]*\)|`[^`]*`", "", text)
    return _NUMBER.findall(_SPAN.sub(" ", plain))


def decimals(number: str) -> int:
    return len(number.partition(".")[2])


def unfounded(claim: str, tables: str) -> list[str]:
    """Numbers of ``claim`` that no number of ``tables`` rounds to."""
    found = [float(n.replace(",", "")) for n in numbers(tables)]
    return [
        n
        for n in numbers(claim)
        if not any(
            abs(value - float(n.replace(",", ""))) <= 0.5001 * 10 ** -decimals(n) for value in found
        )
    ]


def linked(cells: list[str]) -> Iterator[str]:
    """The sections that a row links to."""
    for link in _LINK.findall(" ".join(cells)):
        yield section(*link)


def tables_in(text: str) -> str:
    return "\n".join(" | ".join(row) for row in rows(text))


def results() -> list[list[str]]:
    text = (DOCS / "results.md").read_text(encoding="utf-8")
    return [row for row in rows(text) if row[0] and not row[0].startswith("---")]


LINKED = [row for row in results() if _LINK.search(row[2])]


@pytest.mark.parametrize("row", LINKED, ids=lambda row: row[0][:40])
def test_a_result_stands_in_the_table_that_it_names(row: list[str]) -> None:
    assert numbers(row[1])
    assert unfounded(row[1], "\n".join(map(tables_in, linked(row)))) == []


def test_every_result_names_its_table_or_its_test() -> None:
    others = [row for row in results() if row not in LINKED]
    named = [re.findall(r"`(tests/[\w/]+\.py)`", row[2]) for row in others]
    assert len(LINKED) > 5
    assert all(named)
    assert all((ROOT / file).is_file() for files in named for file in files)


def test_positions_of_the_comparison_are_those_of_the_benchmark() -> None:
    ours = [
        row
        for row in rows(section("comparison.md", "touches-position"))
        if re.match(r"(tomoskin|authors' network)?[ ,\d]+$", row[0])
    ]
    measured = tables_in(section("benchmarks-touch.md", "touch-from-labelled-presses"))
    assert len(ours) > 6
    assert [unfounded(" | ".join(row), measured) for row in ours] == [[]] * len(ours)


def compared() -> list[list[str]]:
    """Rows of force, transfer and rubbing with a figure of ours."""
    text = section("comparison.md", "touches-force-transfer-rubbing")
    return [row for row in rows(text) if numbers(row[1])]


@pytest.mark.parametrize("row", compared(), ids=lambda row: row[0][:40])
def test_a_comparison_stands_in_the_section_that_it_names(row: list[str]) -> None:
    assert unfounded(" ".join(row[1:]), "\n".join(linked(row))) == []
    assert "`tomoskin bench " in row[1]


def test_a_wrong_figure_is_found() -> None:
    table = "| 2.40 | 97.6 | 1,645 | 92 % |"
    assert unfounded("2.4 mm, 98 times, 1,645 cells, 92 %", table) == []
    assert unfounded("2.5 and 97 and 1,640", table) == ["2.5", "97", "1,640"]
    assert slug("### Touches: force, transfer, rubbing") == "touches-force-transfer-rubbing"
