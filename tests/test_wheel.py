"""The wheel holds all that an install needs, and nothing of how it was made."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return the names of the files in a wheel of this tree, whose page must be built."""
    if subprocess.run(
        [sys.executable, "scripts/page.py", "fresh"], cwd=ROOT, check=False
    ).returncode:
        pytest.skip("the page is not built: make page")
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as archive:
        return archive.namelist()


def test_the_built_page_is_in_it(wheel: list[str]) -> None:
    static = "tomoskin/live/static/"
    assert static + "index.html" in wheel
    assert {Path(name).suffix for name in wheel if name.startswith(static)} >= {".js", ".css"}


def test_every_file_of_the_library_is_in_it(wheel: list[str]) -> None:
    source = ROOT / "src"
    suffixes = {".py", ".toml", ".typed"}
    files = {
        file.relative_to(source).as_posix()
        for file in source.glob("tomoskin/**/*")
        if file.suffix in suffixes and "web" not in file.parts
    }
    assert files - set(wheel) == set()


def test_the_sources_of_the_page_are_not(wheel: list[str]) -> None:
    assert [name for name in wheel if "/web/" in name or "node_modules" in name] == []


def test_licences_are_in_it(wheel: list[str]) -> None:
    assert {Path(name).name for name in wheel if "/licenses/" in name} == {"LICENSE", "NOTICE"}
