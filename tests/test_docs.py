"""The Python of the documentation's pages is run as it stands."""

from __future__ import annotations

import csv
import math
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from tomoskin.cli import main
from tomoskin.cli.app import app
from tomoskin.cli.bench import known_benchmarks
from tomoskin.model.skin import Skin

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
THEORY = [f for f in DOCS.glob("theory/*.md") if BLOCK.search(f.read_text(encoding="utf-8"))]
RUNS = "A test runs these blocks"
"""What a page of an extra says where it is so."""

RUN = [
    "build.md",
    "equivalents.md",
    "frequencies.md",
    "python.md",
    *sorted(f"theory/{f.name}" for f in THEORY),
    *sorted(f"extras/{f.name}" for f in DOCS.glob("extras/*.md") if RUNS in f.read_text("utf-8")),
]


@pytest.mark.parametrize("page", RUN)
def test_what_a_page_shows_works(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # some write files
    blocks = BLOCK.findall((DOCS / page).read_text(encoding="utf-8"))
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        if "from lerobot" not in block:  # which has a test of its own
            exec(compile(block, page, "exec"), names)


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))], ids=lambda p: p.stem
)
def test_what_cannot_be_run_is_python_all_the_same(page: Path) -> None:
    """Fragments, and programs that wait for a robot."""
    for block in BLOCK.findall(page.read_text(encoding="utf-8")):
        compile(block, page.name, "exec")


def test_every_benchmark_that_is_named_exists() -> None:
    pages = [ROOT / "README.md", *DOCS.rglob("*.md")]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    named = set(re.findall(r"`tomoskin bench ([a-z_]+)", text))
    assert len(named) > 10
    assert sorted(named - set(known_benchmarks())) == []


def options(command: Any) -> Iterator[str]:
    """Of a command and of those below it."""
    for parameter in command.params:
        yield from parameter.opts
    for name in command.list_commands(None) if hasattr(command, "list_commands") else ():
        yield from options(command.get_command(None, name))


def test_every_option_that_is_named_exists() -> None:
    pages = [ROOT / "README.md", *DOCS.rglob("*.md")]
    text = "\n".join(page.read_text(encoding="utf-8") for page in pages)
    named = set(re.findall(r"`(--[a-z-]+)", text))
    assert len(named) > 15
    assert named - set(options(get_command(app))) == {"--help"}


def missing_files(text: str, files: list[str]) -> list[str]:
    """Files of code that a page names and that are not there, by the end of their path."""
    named = re.findall(r"`([\w./-]+\.(?:py|rs|tsx?|c|h|cpp|sh|css))`", text)
    return [
        name
        for name in named
        if not any(f"/{file}".endswith(f"/{name.removeprefix('../')}") for file in files)
    ]


def test_files_that_pages_name_are_there() -> None:
    listed = subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True
    )
    files = listed.stdout.split()
    pages = {
        file: (ROOT / file).read_text(encoding="utf-8") for file in files if file.endswith(".md")
    }
    found = {
        page: missing for page, text in pages.items() if (missing := missing_files(text, files))
    }
    assert found == {"CONTRIBUTING.md": ["central.py"]}  # a prior that the reader writes


def test_links_of_the_changelog_lead_somewhere() -> None:
    """``test_prose.py`` looks after all other pages."""
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text)
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_the_skin_of_the_instructions_is_one_and_costs_what_is_said(tmp_path: Path) -> None:
    page = (DOCS / "build.md").read_text(encoding="utf-8")
    described = re.search(r"^```toml\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert described
    (tmp_path / "my-skin.toml").write_text(described[1])
    mine, built_in = Skin.load(str(tmp_path / "my-skin.toml")), Skin.load("textile-disc-8")
    assert mine.electrode_centres == pytest.approx(built_in.electrode_centres)
    assert mine.current == built_in.current
    with (ROOT / "hardware" / "board-8.csv").open(encoding="utf-8") as file:
        board = sum(float(row["EUR each"]) * int(row["Quantity"]) for row in csv.DictReader(file))
    costs = re.findall(r"^\| (.+?) \| \**(\d+)\** \|", page, re.MULTILINE)
    euros = {re.sub(r"\W+", " ", name).strip(): int(value) for name, value in costs}
    skin, with_arduino, everything = (
        euros[name] for name in ("the skin", "skin and Arduino", "all that a touch needs")
    )
    items = [n for n in euros.values() if n not in (skin, with_arduino, everything)]
    assert euros["parts of the board for 8 channels"] == round(board)
    assert (sum(items), with_arduino) == (everything, skin + euros["Arduino Mega 2560"])
    assert with_arduino < 60


def test_the_first_steps_give_a_touch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The script on the page of the first steps: simulated, and the press found in it."""
    page = (DOCS / "start.md").read_text(encoding="utf-8")
    script = re.search(r"^```toml\n(.*?)^```", page, re.DOTALL | re.MULTILINE)
    assert script
    (tmp_path / "press.toml").write_text(script[1])
    steps = [
        line.split()[1:]
        for line in page.splitlines()
        if line.startswith(("tomoskin simulate", "tomoskin session", "tomoskin image"))
    ]
    assert [step[0] for step in steps] == ["simulate", "session", "image"]
    monkeypatch.chdir(tmp_path)
    for step in steps:
        with pytest.raises(SystemExit) as end:
            main(step)
        assert not end.value.code
    rows = (tmp_path / "touches.csv").read_text().splitlines()[1:]
    places = [tuple(map(float, row.split(",")[3:5])) for row in rows]
    assert len(places) > 10
    assert min(math.dist(place, (0.03, 0.02)) for place in places) < 0.005


def test_every_example_is_in_the_gallery() -> None:
    page = (DOCS / "gallery.md").read_text(encoding="utf-8")
    scripts = [
        file.name
        for file in (ROOT / "examples").glob("*.py")
        if '__name__ == "__main__"' in file.read_text(encoding="utf-8")
    ]
    assert len(scripts) > 10
    assert [name for name in scripts if f"examples/{name}" not in page] == []
    figures = list((DOCS / "images" / "gallery").glob("*.webp"))
    assert [file.name for file in figures if f"gallery/{file.name}" not in page] == []
    # ANMF: a frame of an animated WebP
    most = {file: 200_000 if b"ANMF" in file.read_bytes() else 60_000 for file in figures}
    assert [file.name for file in figures if file.stat().st_size > most[file]] == []
