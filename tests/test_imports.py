"""The rooms' order, read from the imports themselves."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
UNITS = {
    "core": (),
    "model": ("section", "mesh", "pattern", "prior", "skin", "forward"),
    "imaging": (),
    "board": ("wire", "source"),
    "sensing": ("signal", "track", "segment", "fit"),
    "learning": (),
    "pipeline": (),
    "twin": (),
    "files": ("messages", "session", "imports", "exports"),
    "run": ("sinks", "."),
    "server": (),
    "cli": (),
}
"""The rooms in their order, and in some of them further packages with an order of their own. Others
import from the package itself, so what it imports as itself (``X as X``) is what it offers; "."
are the room's modules."""

EXTRAS = "extras"
"""The folder of features that can be taken out: each may import what rooms offer."""

ROOMS = list(UNITS)
ORDER = [
    room if part == "." else f"{room}.{part}"
    for room, parts in UNITS.items()
    for part in parts or (".",)
]
Sources = Mapping[str, str]


@dataclass(frozen=True)
class Import:
    """One imported name: the module it comes from ("" when the module itself is imported)."""

    line: int
    module: str
    name: str
    runs_at_import: bool


# What is checked: module name → source text, a package under its own name.


@cache
def library() -> dict[str, str]:
    source = ROOT / "src"
    return {
        ".".join(file.relative_to(source).with_suffix("").parts).removesuffix(".__init__"): (
            file.read_text(encoding="utf-8")
        )
        for file in sorted(source.glob("tomoskin/**/*.py"))
        if "node_modules" not in file.parts
    }


def imports_of(module: str, sources: Sources) -> Iterator[Import]:
    """Every import in `module`, wherever it stands; relative ones resolved."""
    is_package = any(name.startswith(f"{module}.") for name in sources)
    package = module if is_package else module.rpartition(".")[0]
    tree = ast.parse(sources[module])
    deferred = set(_deferred(tree))
    for node in ast.walk(tree):
        runs = node not in deferred
        match node:
            case ast.Import(names=names):
                for alias in names:
                    yield Import(node.lineno, alias.name, "", runs)
            case ast.ImportFrom(module=origin, names=names, level=level):
                parts = package.split(".")
                base = parts[: len(parts) - level + 1] if level else []
                for alias in names:
                    full = ".".join([*base, *([origin] if origin else [])])
                    yield Import(node.lineno, full, alias.name, runs)
            case ast.Call(func=ast.Attribute(attr="import_module"), args=[ast.Constant(value), *_]):
                yield Import(node.lineno, str(value), "", runs_at_import=False)


def _deferred(tree: ast.Module) -> Iterator[ast.AST]:
    """Everything inside a function or behind TYPE_CHECKING: it does not run at import."""
    for node in ast.walk(tree):
        typing_only = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if typing_only or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            yield from (child for child in ast.walk(node) if child is not node)


def unit_of(module: str) -> str | None:
    """The room of a module, or its package in :data:`ORDER`.

    None for the package itself, and for the program that stands above all rooms.
    """
    parts = module.split(".")
    if parts[0] != "tomoskin" or parts[1:] in ([], ["__main__"]):
        return None
    inner = ".".join(parts[1:3])
    return inner if inner in ORDER or (parts[1] == EXTRAS and parts[2:]) else parts[1]


def violations(sources: Sources) -> list[str]:
    """Every import that breaks the order or reaches into another room, in words."""
    return [
        f"{module}:{found.line}: {why}"
        for module in sources
        for found in imports_of(module, sources)
        if (why := _wrong(module, found, sources))
    ]


def _wrong(module: str, found: Import, sources: Sources) -> str | None:
    here = unit_of(module)
    if here is None or found.module.split(".")[0] != "tomoskin":
        return None
    full = f"{found.module}.{found.name}"
    if full in {f"tomoskin.{unit}" for unit in (*ROOMS, *ORDER)}:
        found = Import(found.line, full, "", found.runs_at_import)
    there = unit_of(found.module)
    if EXTRAS in (here.partition(".")[0], (there or "").partition(".")[0]):
        return _wrong_with_extras(here, there, found, sources)
    if there is None:
        own = found.name == "__version__"
        return None if own else "a room imports rooms, not the package above them"
    if there == here:
        return _wrong_inside(module, found, sources)
    return _wrong_across(here, there, found, sources)


def _wrong_with_extras(here: str, there: str | None, found: Import, sources: Sources) -> str | None:
    if not here.startswith(f"{EXTRAS}."):
        return "the core never names an extra"
    if there is None or there == here:
        own = there or found.name == "__version__"
        return None if own else "an extra imports rooms, not the package above them"
    if there.startswith(f"{EXTRAS}."):
        used = there.partition(".")[2] in uses(here.partition(".")[2])
        return None if used else f'{here} must say so: uses = ["{there[7:]}"] in its extra.toml'
    if there not in ORDER:
        return f"no such room: {there}"
    if _is_inner(there, found, sources):
        return f"import from tomoskin.{there}, not from its inner modules"
    return None


def uses(extra: str) -> list[str]:
    """The extras that an ``extra`` says it cannot do without."""
    table = ROOT / "src" / "tomoskin" / EXTRAS / extra / "extra.toml"
    return list(tomllib.loads(table.read_text(encoding="utf-8")).get("uses", ()))


def _wrong_across(here: str, there: str, found: Import, sources: Sources) -> str | None:
    unknown = {here, there} - set(ORDER)
    if unknown:
        return f"no such room: {', '.join(sorted(unknown))}"
    if ORDER.index(there) > ORDER.index(here):
        return f"{here} stands above {there} and must not import it"
    if _is_inner(there, found, sources):
        return f"import from tomoskin.{there}, not from its inner modules"
    return None


def _wrong_inside(module: str, found: Import, sources: Sources) -> str | None:
    unit = f"tomoskin.{unit_of(module)}"
    if found.module == unit and module != unit and f"{unit}.{found.name}" not in sources:
        return f"inside {unit_of(module)}, import from its modules"
    return None


def _is_inner(there: str, found: Import, sources: Sources) -> bool:
    if found.module != f"tomoskin.{there}":
        return True
    is_module = f"{found.module}.{found.name}" in sources
    return is_module and found.name not in offered(sources.get(found.module, ""))


def offered(source: str) -> set[str]:
    """The names that a package imports as themselves (``X as X``)."""
    return {
        alias.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
        if alias.name == alias.asname
    }


def cycle(sources: Sources) -> list[str]:
    """The modules of an import cycle, in order; empty when there is none."""
    graph: dict[str, set[str]] = {}
    for module in sources:
        targets = {
            target
            for found in imports_of(module, sources)
            if found.runs_at_import
            for target in (f"{found.module}.{found.name}", found.module)
            if target in sources
        }
        # A package's __init__ may import its modules; they do not wait for it in return.
        graph[module] = {t for t in targets if not module.startswith(f"{t}.")} - {module}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def table_rooms(text: str) -> list[str]:
    """The second column of the rooms' table in docs/architecture.md."""
    return re.findall(r"^\| \w+ \| `(\w+)` \|", text, flags=re.MULTILINE)


# The library.


def test_rooms_import_only_from_rooms_above() -> None:
    assert violations(library()) == []


def test_no_import_cycle() -> None:
    assert cycle(library()) == []


def test_every_module_stands_in_a_room() -> None:
    units = {unit_of(module) or "" for module in library()} - {"", EXTRAS}
    assert {unit for unit in units if not unit.startswith(f"{EXTRAS}.")} == {*ROOMS, *ORDER}


def test_the_documented_order_is_the_order() -> None:
    assert table_rooms((ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")) == ROOMS


# The checkers, on planted mistakes.

ROOM = {
    "tomoskin": "",
    "tomoskin.core": "from x import errors as errors",
    "tomoskin.core.errors": "",
}


@pytest.mark.parametrize(
    "source",
    [
        "from tomoskin.server import serve",
        "import tomoskin.server",
        "import tomoskin.server as page",
        "from tomoskin import server",
        "from ..server import serve",
        "def later():\n    from tomoskin.server import serve",
        "if TYPE_CHECKING:\n    from tomoskin.server import serve",
        "import importlib\nimportlib.import_module('tomoskin.server')",
        "from tomoskin.model.mesh.mesh import Mesh",
        "from tomoskin.model.mesh import mesh",
        "from tomoskin.nowhere import thing",
        "from tomoskin import Skin",
        "from tomoskin.model.skin import Skin",
        "from tomoskin.extras.dust import Dust",
        "from tomoskin import extras",
    ],
)
def test_a_planted_import_is_found(source: str) -> None:
    mesh = {"tomoskin.model.mesh": "from x import Mesh as Mesh", "tomoskin.model.mesh.mesh": ""}
    planted = {**ROOM, **mesh, "tomoskin.model.skin": "", "tomoskin.model.skin.load": source}
    assert len(violations(planted)) == 1


@pytest.mark.parametrize(
    "source",
    [
        "from tomoskin.core import DataError, errors",
        "from tomoskin.model.skin.outline import Disc",
        "from tomoskin.model.skin import outline",
        "from .outline import Disc",
        "from tomoskin import __version__",
        "import numpy.linalg",
        "'from tomoskin.server import serve'",
    ],
)
def test_what_is_allowed_passes(source: str) -> None:
    planted = {**ROOM, "tomoskin.model.skin": "", "tomoskin.model.skin.load": source}
    assert violations({**planted, "tomoskin.model.skin.outline": ""}) == []


@pytest.mark.parametrize(
    ("source", "count"),
    [
        ("from tomoskin.core import DataError", 0),
        ("from tomoskin.extras.dust.cloud import Cloud", 0),
        ("from tomoskin.core.errors import DataError", 1),
        ("from tomoskin.extras.rain import Rain", 1),
        ("from tomoskin.nowhere import thing", 1),
        ("from tomoskin import Skin", 1),
    ],
)
def test_what_an_extra_may_import(source: str, count: int, monkeypatch) -> None:
    monkeypatch.setitem(globals(), "uses", lambda _: [])
    dust = {"tomoskin.extras.dust": source, "tomoskin.extras.dust.cloud": ""}
    assert len(violations({**ROOM, **dust, "tomoskin.extras.rain": ""})) == count


def test_an_extra_that_says_so_may_import_another(monkeypatch) -> None:
    monkeypatch.setitem(globals(), "uses", lambda extra: ["rain"] if extra == "dust" else [])
    dust = {"tomoskin.extras.dust": "from tomoskin.extras.rain import Rain"}
    assert violations({**ROOM, **dust, "tomoskin.extras.rain": ""}) == []


def test_a_planted_cycle_is_found() -> None:
    planted = {"tomoskin.core.a": "from tomoskin.core.b import x", "tomoskin.core": ""}
    first = {**planted, "tomoskin.core.b": "from tomoskin.core import a"}
    assert set(cycle(first)) == {"tomoskin.core.a", "tomoskin.core.b"}
    deferred = {**planted, "tomoskin.core.b": "def f():\n    from tomoskin.core.a import y"}
    assert cycle(deferred) == []


def test_a_changed_table_is_seen() -> None:
    assert table_rooms("| flow | room |\n|---|---|\n| a | `core` | x |\n| b | `mesh` | y |\n") == [
        "core",
        "mesh",
    ]
