"""Each extra can be taken out: its folder with code, its tests, its page of the documentation.

The usual suite imports every module that is left and asks every command for help. The slow tests
serve a page without each of them, and run the core's own tests where there is none at all.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
import urllib.request
from collections.abc import Collection
from pathlib import Path
from shutil import copytree, ignore_patterns, rmtree

import pytest

from tomoskin.core import extra_names

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "tomoskin"
LEFT_ALONE = ignore_patterns(
    ".git", ".venv", "build", "dist", "node_modules", "__pycache__", ".*_cache"
)
"""What no test reads."""

TRY = """
import pkgutil, sys
from importlib import import_module
import tomoskin
from tomoskin.cli import app, main

for found in pkgutil.walk_packages(tomoskin.__path__, "tomoskin."):
    if not found.name.endswith("__main__"):
        import_module(found.name)
for words in ([], *([name] for name in app.COMMANDS)):
    try:
        main([*words, "--help"])
    except SystemExit as end:
        assert not end.code, (words, end.code)
print(tomoskin.__path__[0])
"""
"""Imports what is there, and asks the program and each command of the core for help."""


def with_users(extra: str) -> set[str]:
    """The extra, and those that say they cannot do without it."""
    gone, before = {extra}, set[str]()
    while gone != before:
        before = set(gone)
        for name in extra_names():
            table = (PACKAGE / "extras" / name / "extra.toml").read_text(encoding="utf-8")
            if set(tomllib.loads(table).get("uses", ())) & gone:
                gone.add(name)
    return gone


def without(extras: Collection[str], folder: Path) -> Path:
    """A tree of the package without some extras, for PYTHONPATH; the other files are links."""
    package = folder / "tomoskin"
    (package / "extras").mkdir(parents=True)
    for entry in PACKAGE.iterdir():
        if entry.name not in ("extras", "__pycache__"):
            (package / entry.name).symlink_to(entry)
    for entry in (PACKAGE / "extras").iterdir():
        if entry.name not in {*extras, "__pycache__"}:
            (package / "extras" / entry.name).symlink_to(entry)
    return folder


def run(path: Path, *words: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PYTHONPATH": str(path)}
    command = [sys.executable, *words]
    return subprocess.run(
        command, env=environment, cwd=cwd, capture_output=True, text=True, check=False
    )


def test_the_copy_is_what_is_imported(tmp_path: Path) -> None:
    found = run(without((), tmp_path), "-c", "import tomoskin; print(tomoskin.__path__[0])")
    assert found.stdout.strip() == str(tmp_path / "tomoskin")


def test_a_module_that_needs_what_is_gone_is_seen(tmp_path: Path) -> None:
    tree = without((), tmp_path)
    (tree / "tomoskin" / "planted.py").write_text("import tomoskin.extras.gone\n")
    assert "No module named 'tomoskin.extras.gone'" in run(tree, "-c", TRY).stderr


@pytest.mark.parametrize("extra", [None, *extra_names()])
def test_without_an_extra_all_else_imports_and_explains_itself(
    extra: str | None, tmp_path: Path
) -> None:
    gone = set(extra_names()) if extra is None else with_users(extra)
    tried = run(without(gone, tmp_path), "-c", TRY)
    assert tried.returncode == 0, tried.stderr
    assert tried.stdout.splitlines()[-1] == str(tmp_path / "tomoskin")


@pytest.mark.parametrize("extra", extra_names())
def test_an_extra_has_its_tests_and_its_page(extra: str) -> None:
    assert list((ROOT / "tests" / "extras" / extra).glob("**/test_*.py"))
    assert (ROOT / "docs" / "extras" / f"{extra}.md").is_file()


def test_no_file_of_the_core_names_an_extra() -> None:
    named = re.compile(r"tomoskin\.extras\.\w|extras/\w")
    files = (file for file in PACKAGE.rglob("*.py") if PACKAGE / "extras" not in file.parents)
    assert [str(file) for file in files if named.search(file.read_text(encoding="utf-8"))] == []


@pytest.mark.slow
@pytest.mark.parametrize("extra", [None, *extra_names()])
def test_without_an_extra_a_page_is_served(extra: str | None, tmp_path: Path) -> None:
    gone = set(extra_names()) if extra is None else with_users(extra)
    command = [sys.executable, "-m", "tomoskin", "live", "--port", "0", "--json"]
    with subprocess.Popen(
        command,
        env=os.environ | {"PYTHONPATH": str(without(gone, tmp_path))},
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
    ) as program:
        try:
            assert program.stdout is not None
            found = re.search(r'"address": *"([^"]+)"', program.stdout.readline())
            assert found is not None
            address = found[1]
            with urllib.request.urlopen(address) as answer:
                assert b"<title>tomoskin" in answer.read()
        finally:
            program.terminate()


@pytest.mark.slow
def test_without_any_extra_the_cores_tests_pass(tmp_path: Path) -> None:
    tree = tmp_path / "tree"
    copytree(ROOT, tree, ignore=LEFT_ALONE)
    (tmp_path / "shared").symlink_to(ROOT.parent / "shared")
    for name in extra_names():
        for folder in ("src/tomoskin/extras", "tests/extras"):
            rmtree(tree / folder / name)
        (tree / "docs" / "extras" / f"{name}.md").unlink()
    words = ("-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", "-x", "tests")
    done = run(tree / "src", *words, cwd=tree)
    assert done.returncode == 0, done.stdout[-4000:]
