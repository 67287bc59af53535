"""Files of a user that are no files, and those that cannot be read."""

import os
import sys
from pathlib import Path

import pytest

from tomoskin.core import DataError, GeometryError, load_arrays, open_input
from tomoskin.files.imports.reader import read_recording
from tomoskin.files.imports.text_lines import text_lines
from tomoskin.files.session import SessionReader
from tomoskin.files.session.repair import repair
from tomoskin.model.mesh import Mesh

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no named pipes")


@pytest.fixture
def pipe(tmp_path: Path) -> Path:
    path = tmp_path / "pipe.mcap"
    os.mkfifo(path)
    return path


READERS = [
    open_input,
    load_arrays,
    read_recording,
    SessionReader,
    text_lines,
    lambda path: repair(path, path.with_name("new.mcap")),
]


@pytest.mark.parametrize("read", READERS)
def test_every_reader_says_in_the_same_words_what_is_no_file(tmp_path: Path, read) -> None:  # type: ignore[no-untyped-def]
    for path, said in (("none.mcap", "there is no such file"), ("", "is a folder, not a file")):
        with pytest.raises(DataError, match=f"{said}$"):
            list(read(tmp_path / path))


@pytest.mark.parametrize("read", [reader for reader in READERS if reader is not text_lines])
def test_a_pipe_is_refused_at_once(pipe: Path, read) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(DataError, match=r"pipe.mcap: is a pipe or a device.*into a file"):
        read(pipe)


def test_a_mesh_does_not_come_from_a_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "scan.stl")
    with pytest.raises(GeometryError, match=r"scan.stl: is a pipe or a device"):
        Mesh.read(tmp_path / "scan.stl")


def test_a_mesh_that_takes_for_ever_is_refused_at_once(tmp_path: Path) -> None:
    path = tmp_path / "scan.stl"
    with path.open("wb") as file:
        file.truncate(50_000_001)
    with pytest.raises(GeometryError, match=r"too large for a mesh \(50 MB.*simplify it"):
        Mesh.read(path)


def test_what_is_no_file_says_what_it_is(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="is a folder, not a file"):
        open_input(tmp_path)
    with pytest.raises(DataError, match="there is no such file"):
        open_input(tmp_path / "none")
    with pytest.raises(DataError, match="cannot be read"):
        open_input(tmp_path / ("x" * 5000))
