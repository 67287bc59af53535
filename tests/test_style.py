"""House rules that no linter knows: short modules, quiet library, files that name no machine."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
MOST_LINES = 500
NO_HOME_FOR_IDEAS = {"utils", "util", "helpers", "misc", "common"}
VAGUE = {"told", "seen", "beside", "found", "left"}
UNFINISHED = "src/tomoskin/(sensing/(fit|track)/|pipeline/drives.py)"
"""Where such names are left."""

# Put together here, since this file may not hold them either.
HOSTS = [
    ".".join(parts)
    for parts in (
        ("pypi", "org"),
        ("files", "pythonhosted", "org"),
        ("registry", "npmjs", "org"),
        ("crates", "io"),
        ("proxy", "golang", "org"),
        ("repo", "maven", "apache", "org"),
        ("repo1", "maven", "org"),
        ("deb", "debian", "org"),
    )
]
MACHINE_PATH = re.compile(r"(?<![\w./-])/(?:work|root|home|Users|tmp)/[\w.]")
LOCK_NAMES = re.compile(r"(^|/)(package-lock\.json|requirements/\w+\.txt|uv\.lock|Cargo\.lock)$")
LOCK_ADDRESS = re.compile(
    r"""["']resolved["']\s*:\s*["']|--(?:extra-)?index-url|--find-links|@ https?://|^source = """
    r"""|\burl = ["']""",
    re.MULTILINE,
)


def tracked() -> dict[str, str]:
    """Every text file under version control, by path."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode:
        pytest.skip("not a git checkout")
    paths = [ROOT / name for name in listed.stdout.decode().split("\0") if name]
    return {p.relative_to(ROOT).as_posix(): text for p in paths if (text := _text(p)) is not None}


def _text(file: Path) -> str | None:
    try:
        return file.read_text(encoding="utf-8")
    except (UnicodeDecodeError, FileNotFoundError, IsADirectoryError):
        return None


def python_only(files: dict[str, str]) -> dict[str, str]:
    return {path: text for path, text in files.items() if path.endswith(".py")}


def too_long(files: dict[str, str]) -> list[str]:
    return [path for path, text in files.items() if text.count("\n") > MOST_LINES]


def catch_alls(files: dict[str, str]) -> list[str]:
    """Modules and packages named for no idea at all."""
    return [
        path for path in files if NO_HOME_FOR_IDEAS & {p.split(".")[0] for p in path.split("/")}
    ]


def printers(files: dict[str, str]) -> list[str]:
    """Calls of print in the library."""
    library = {path: text for path, text in files.items() if path.startswith("src/")}
    return [f"{path}:{line}" for path, text in library.items() for line in _prints(text)]


def _prints(text: str) -> Iterator[int]:
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Call) and ast.unparse(node.func) in ("print", "builtins.print"):
            yield node.lineno


def vague_names(files: dict[str, str]) -> list[str]:
    """Functions, parameters and variables of the library whose name does not say what they are."""
    rooms = {p: t for p, t in files.items() if re.match("src/tomoskin/", p)}
    return [
        f"{path}:{line}: {name}"
        for path, text in rooms.items()
        if not re.match(UNFINISHED, path)
        for line, name in _names(ast.parse(text))
        if name.strip("_") in VAGUE
    ]


def _names(tree: ast.AST) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.id
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.lineno, node.name


def machine_words(files: dict[str, str]) -> list[str]:
    """Paths of one machine and names of package registries."""
    return [
        f"{path}:{number}: {found}"
        for path, text in files.items()
        for number, line in enumerate(text.splitlines(), start=1)
        for found in [*MACHINE_PATH.findall(line), *(host for host in HOSTS if host in line)]
    ]


def lock_addresses(files: dict[str, str]) -> list[str]:
    """Lock files that record where a package was downloaded."""
    locks = {path: text for path, text in files.items() if LOCK_NAMES.search(path)}
    return [path for path, text in locks.items() if LOCK_ADDRESS.search(text)]


# The repository.


def test_no_module_is_too_long() -> None:
    assert too_long(python_only(tracked())) == []


def test_no_module_is_a_catch_all() -> None:
    assert catch_alls(python_only(tracked())) == []


def test_the_library_does_not_print() -> None:
    assert printers(python_only(tracked())) == []


def test_names_say_what_they_are() -> None:
    assert vague_names(python_only(tracked())) == []


def test_no_file_names_a_machine() -> None:
    assert machine_words(tracked()) == []


def test_lock_files_hold_hashes_and_no_addresses() -> None:
    files = tracked()
    assert lock_addresses(files) == []
    pinned = [text for path, text in files.items() if re.match(r"requirements/\w+\.txt$", path)]
    assert pinned
    for text in pinned:
        assert text.count("==") <= text.count("--hash=sha256:")


# The checkers, on planted mistakes.


def test_planted_mistakes_in_python_are_found() -> None:
    assert too_long({"a.py": "x\n" * (MOST_LINES + 1), "b.py": "x\n"}) == ["a.py"]
    bad = ["src/tomoskin/utils.py", "src/tomoskin/mesh/helpers/x.py"]
    assert catch_alls(dict.fromkeys([*bad, "src/tomoskin/model/mesh/mesh.py"], "")) == bad
    loud = "def f():\n    print(1)\n"
    assert printers({"src/a.py": loud, "tests/b.py": loud}) == ["src/a.py:2"]
    assert printers({"src/a.py": "'print(1)'  # print(2)\nself.print(3)\n"}) == []


def test_planted_vague_names_are_found() -> None:
    text = "def told(seen, a):\n    left, b = seen, a\n    return b.left\n"
    path = "src/tomoskin/cli/a.py"
    assert vague_names({path: text, "tests/b.py": text}) == [
        f"{path}:1: told",
        f"{path}:1: seen",
        f"{path}:2: left",
    ]


@pytest.mark.parametrize("text", ["see /" + "work/x", "'/" + "root/.venv'", "=/" + "home/ann"])
def test_a_planted_path_is_found(text: str) -> None:
    assert len(machine_words({"a.md": text})) == 1


@pytest.mark.parametrize(
    "text", ["a/work/x", "https://host/work/x", "/usr/bin/chromium", "./tmp/x"]
)
def test_other_paths_pass(text: str) -> None:
    assert machine_words({"a.md": text}) == []


@pytest.mark.parametrize("host", HOSTS)
def test_a_planted_registry_is_found(host: str) -> None:
    assert machine_words({"a.txt": f"from https://{host}/simple"}) == [f"a.txt:1: {host}"]


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("web/package-lock.json", '{"resolved": "https://host/x.tgz"}'),
        ("requirements/dev.txt", "--index-url https://host/simple\n"),
        ("requirements/dev.txt", "x @ https://host/x.whl\n"),
        ("uv.lock", 'source = { registry = "https://host" }\n'),
    ],
)
def test_a_planted_address_in_a_lock_file_is_found(path: str, text: str) -> None:
    assert lock_addresses({path: text}) == [path]
    assert lock_addresses({"README.md": text}) == []
