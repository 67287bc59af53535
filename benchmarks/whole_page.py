"""The page, by the benchmark of that name; left out where there is no browser."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from importlib.util import find_spec

import page
from tomoskin.server import STATIC
from whole_line import Line

CELLS = 3000
BROWSERS = ("chromium", "google-chrome")


def page_lines() -> Iterator[Line]:
    """Numbers of the page itself; its settings are `tomoskin bench page`'s."""
    if missing := _missing():
        yield Line(f"not measured: no {missing}", "–", None)
        return
    page.CELLS = {CELLS: page.CELLS[CELLS]}  # its finer sheets take minutes more
    for what, value, promised in page.run(None)[0].rows:
        name, _, unit = what.partition(", ")
        yield Line(name, unit or "–", value, promised)


def _missing() -> str:
    if not (STATIC / "index.html").is_file():
        return "built page (make page)"
    if find_spec("playwright") is None:
        return "playwright (requirements/dev.txt)"
    return "" if any(map(shutil.which, BROWSERS)) else "Chromium"
