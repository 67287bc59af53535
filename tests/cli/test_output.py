"""Tables of benchmarks in narrow terminals."""

import io

import pytest
from rich.console import Console

from tomoskin.cli.output import tables

HEADINGS = ("skin", "preset", "triangles", "whole frame ms", "times real time")
ROWS = (("textile-disc-16", "ideal", 2982, 1.645, 58.6), ("tank-16", "tank", 2952, 1.7, 126.1))


def printed(width):
    console = Console(file=io.StringIO(), width=width)
    for table in tables("a title", HEADINGS, ROWS, width):
        console.print(table, crop=False)
    return console.file.getvalue().splitlines()


@pytest.mark.parametrize("width", [20, 40, 50, 80, 200])
def test_nothing_is_cut_off(width):
    lines = printed(width)
    words = " ".join(lines).split()
    for word in (*" ".join(HEADINGS).split(), *(str(v) for row in ROWS for v in row)):
        assert word in words
    assert "…" not in "".join(lines)
    assert width < 35 or max(map(len, lines)) <= width


def test_each_part_of_a_wide_table_says_what_its_rows_are_about():
    lines = printed(34)
    assert sum("textile-disc-16 ideal" in line for line in lines) == 2
    assert sum("tank-16         tank" in line for line in lines) == 2
    assert sum("a title" in line for line in lines) == 1


def test_it_stays_one_table_where_there_is_room():
    assert len(tables("", HEADINGS, ROWS, 80)) == 1
