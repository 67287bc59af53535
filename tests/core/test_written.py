"""Files appear when they are complete, and every function that writes one asks first."""

from __future__ import annotations

import ast
import os
import stat
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from files.session.runs import SKIN, write_all
from tomoskin import core
from tomoskin.core import DataError, OutputError, write_text, written
from tomoskin.files import exports, imports
from tomoskin.files.exports import matlab_file, vtu
from tomoskin.files.session import SessionReader
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.signal import Recording

ROOT = Path(__file__).resolve().parents[2]


def test_what_was_there_stays_until_the_end(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("old")
    with written(path, overwrite=True) as part:
        assert part.parent == tmp_path
        assert part.suffix == ".csv"
        part.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("kind", [KeyboardInterrupt, ValueError, OSError, OutputError])
@pytest.mark.parametrize("old", ["old", None])
def test_whatever_ends_it_leaves_the_old_file(
    tmp_path: Path, kind: type[BaseException], old: str | None
) -> None:
    path = tmp_path / "x.csv"
    if old is not None:
        path.write_text(old)

    def half() -> None:
        with written(path, overwrite=True) as part:
            part.write_text("ne")
            raise kind("half-way")

    with pytest.raises(DataError if kind is OSError else kind, match="half-way"):
        half()
    assert [file.read_text() for file in tmp_path.iterdir()] == ([] if old is None else [old])


def test_a_file_that_came_meanwhile_is_not_written_over(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"

    def late() -> None:
        with written(path) as part:
            part.write_text("new")
            path.write_text("somebody's")

    with pytest.raises(OutputError, match="exists already"):
        late()
    assert [file.read_text() for file in tmp_path.iterdir()] == ["somebody's"]


def test_a_link_stays_a_link_and_rights_stay(tmp_path: Path) -> None:
    path, link = tmp_path / "x.csv", tmp_path / "link.csv"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    write_text(link, "new", overwrite=True)
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_new_file_has_the_usual_rights(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_text(tmp_path / "x.toml", "new")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "x.toml").stat().st_mode) == 0o640


# Every function that writes a file.


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_all(tmp_path_factory.mktemp("whole") / "whole.mcap")


def recording() -> Recording:
    pattern = Pattern.adjacent(8)
    values = np.ones((2, pattern.n_meas))
    times = np.arange(2.0)
    return Recording(values, pattern.drive, pattern.measure, times, None, None, False, "test")


def frames() -> Iterator[np.ndarray]:
    yield from np.zeros((2, 4, 4, 3), np.uint8)


def of_session(write: Callable[..., None]) -> Callable[..., None]:
    def run(path: Path, whole: Path, **options: Any) -> None:
        with SessionReader(whole) as session:
            write(exports.Export(session, **options), path)

    return run


def writes(write: Callable[..., Any], *arguments: Any) -> Callable[..., None]:
    def run(path: Path, _: Path, **options: Any) -> None:
        given = [argument() if callable(argument) else argument for argument in arguments]
        write(path, *given, **options)

    return run


WRITERS: dict[str, Callable[..., None]] = {
    "x.toml": writes(core.write_text, "text"),
    "x.npz": writes(core.save_arrays, {"a": np.ones(2)}),
    "interchange.npz": writes(imports.write_interchange, recording),
    "touches.csv": writes(exports.write_touches, ()),
    "curves.png": writes(exports.write_choices, "none", ()),
    "x.vtu": writes(exports.write_vtu, SKIN.mesh, {}),
    "x.pvd": writes(vtu.write_series, SKIN.mesh, ()),
    "x.mat": writes(matlab_file.write_matlab, recording, 1.0, 8),
    "x.gif": lambda path, _, **options: exports.FILMS[".gif"](path, frames(), 10.0, **options),
    "x.csv": of_session(exports.WRITERS[".csv"]),
    "x.parquet": of_session(exports.WRITERS[".parquet"]),
    "x.h5": of_session(exports.WRITERS[".h5"]),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_function_writes_over_what_it_is_told_to(tmp_path: Path, whole: Path, name: str) -> None:
    path, write = tmp_path / name, WRITERS[name]
    path.write_bytes(b"mine")
    with pytest.raises(OutputError, match="overwrite=True"):
        write(path, whole)
    assert path.read_bytes() == b"mine"
    write(path, whole, overwrite=True)
    made = path.read_bytes()
    assert made != b"mine"
    path.write_bytes(whole.read_bytes())
    with pytest.raises(OutputError, match="a recording is never overwritten"):
        write(path, whole, overwrite=True)
    assert path.read_bytes() == whole.read_bytes()
    assert list(tmp_path.iterdir()) == [path]


def test_a_series_asks_for_its_parts_too(tmp_path: Path) -> None:
    mesh = SKIN.mesh()
    moments = [(0.1 * k, {"change": np.zeros(len(mesh.cells))}) for k in range(2)]
    part = tmp_path / "x_000002.vtu"
    part.write_text("mine")
    (tmp_path / "xy_000001.vtu").write_text("another's")
    with pytest.raises(OutputError, match=r"x_000002\.vtu: exists already"):
        vtu.write_series(tmp_path / "x.pvd", mesh, iter(moments))

    def broken() -> Iterator[tuple[float, np.ndarray]]:
        yield from moments
        raise DataError("half-way")

    with pytest.raises(DataError, match="half-way"):
        vtu.write_series(tmp_path / "x.pvd", mesh, broken(), overwrite=True)
    assert part.read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 2
    assert vtu.write_series(tmp_path / "x.pvd", mesh, moments, overwrite=True) == 2
    assert part.read_text().startswith("<?xml")
    assert len(list(tmp_path.iterdir())) == 4


# No other way to write.

OWN_WAYS = {
    "core/written.py": "the way",
    "files/session/session_writer.py": "a session, while it happens, into a file that must be new",
}
OPENERS = {"write_text", "write_bytes", "savefig", "savemat", "ParquetWriter", "mkstemp", "File"}


def unguarded(source: str) -> list[int]:
    """Lines that open a file for writing which did not come from ``written``.

    A function that is handed its file names it ``part`` or ``target``: its caller is looked at.
    """
    tree = ast.parse(source)
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and _writes(node) and not _is_part(node)
    ]


def _writes(call: ast.Call) -> bool:
    name = ast.unparse(call.func).rpartition(".")[2]
    modes = [a.value for a in call.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
    if isinstance(call.func, ast.Name) and name == "write_text":
        return False  # the room's own function, which asks
    opened = name == "open" and any(set("wxa+") & set(mode) and len(mode) < 4 for mode in modes)
    return opened or name in OPENERS


def _is_part(call: ast.Call) -> bool:
    assert isinstance(call.func, ast.Attribute | ast.Name)
    receiver = ast.unparse(call.func.value) if isinstance(call.func, ast.Attribute) else ""
    first = ast.unparse(call.args[0]) if call.args else ""
    return bool({receiver, first} & {"part", "target"})


def test_all_files_of_the_library_are_written_in_one_way() -> None:
    library = ROOT / "src" / "tomoskin"
    found = [
        f"{file.relative_to(library)}:{line}"
        for file in sorted(library.rglob("*.py"))
        if "node_modules" not in file.parts and file.relative_to(library).as_posix() not in OWN_WAYS
        for line in unguarded(file.read_text(encoding="utf-8"))
    ]
    assert found == []


@pytest.mark.parametrize(
    "source",
    ["path.open('w')", "out.write_text(x)", "open(out, mode, 'xb')", "figure.savefig(out)"],
)
def test_a_planted_write_is_found(source: str) -> None:
    assert unguarded(source) == [1]
    assert unguarded("part.open('wb'); path.open(); text.replace('a', 'w'); f.read('rb')") == []
