"""Archives that are torn, foreign or hostile end in a data error that names the file."""

from __future__ import annotations

import io
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

import tomoskin.core.user_files
from tomoskin.core import DataError
from tomoskin.core.archive import load_arrays
from tomoskin.files.imports import read_recording

ARRAYS = {"voltages": np.arange(80.0).reshape(2, 40), "drive": np.ones((40, 2), dtype=np.int8)}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("archives")


def whole(*, compressed: bool = True) -> bytes:
    file = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(file, **ARRAYS)  # type: ignore[arg-type]
    return file.getvalue()


def header(text: str) -> bytes:
    """An .npy member with that header and no data."""
    line = text.encode() + b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(line).to_bytes(2, "little") + line


def refused(path: Path, content: bytes) -> str:
    path.write_bytes(content)
    with pytest.raises(DataError) as caught:
        dict(load_arrays(path))
    assert caught.value.where == str(path)
    return str(caught.value)


def test_arrays_come_back(tmp_path: Path) -> None:
    for compressed in (True, False):
        (tmp_path / "x.npz").write_bytes(whole(compressed=compressed))
        arrays = load_arrays(tmp_path / "x.npz")
        assert arrays.keys() == ARRAYS.keys()
        for key, array in arrays.items():
            assert array.dtype == ARRAYS[key].dtype
            assert np.array_equal(array, ARRAYS[key])


def test_missing(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"gone\.npz: there is no such file"):
        read_recording(tmp_path / "gone.npz")


def test_a_folder(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="is a folder, not a file"):
        read_recording(tmp_path)


@pytest.mark.parametrize("content", [b"\0", b"frame,v0,v1\n1,2,3\n", b"PK\x03\x04", b"\x93NUMPY"])
def test_no_archive(tmp_path: Path, content: bytes) -> None:
    assert "is not a whole .npz archive" in refused(tmp_path / "x.npz", content)


def test_a_single_array(tmp_path: Path) -> None:
    file = io.BytesIO()
    np.save(file, np.ones(3))
    assert "is not a whole .npz archive" in refused(tmp_path / "x.npy", file.getvalue())


@pytest.mark.parametrize("part", [0.02, 0.3, 0.6, 0.9, 0.99])
@pytest.mark.parametrize("end", ["head", "tail"])
def test_torn(tmp_path: Path, part: float, end: str) -> None:
    content = whole()
    cut = int(part * len(content))
    refused(tmp_path / "x.npz", content[:cut] if end == "head" else content[cut:])


@given(st.data())
def test_any_damage_is_a_data_error_or_leaves_the_arrays_alone(
    folder: Path, data: st.DataObject
) -> None:
    content = bytearray(whole(compressed=data.draw(st.booleans())))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = folder / "damaged.npz"
    path.write_bytes(content)
    try:
        arrays = dict(load_arrays(path))
    except DataError:
        return
    for key in arrays.keys() & ARRAYS.keys():
        assert np.array_equal(arrays[key], ARRAYS[key])


def test_pickled_arrays_are_not_unpickled(tmp_path: Path) -> None:
    opened = tmp_path / "opened"

    class Trap:
        def __reduce__(self) -> tuple[object, ...]:
            return Path.touch, (opened,)

    file = io.BytesIO()
    np.savez(file, voltages=np.array([Trap()], dtype=object))
    assert "Object arrays cannot be loaded" in refused(tmp_path / "x.npz", file.getvalue())
    assert not opened.exists()


@pytest.mark.parametrize(
    "text",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (10000000000000,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (1" + 40 * "0" + ",)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-3,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3,)}",
        "{'descr': 'zzz', 'fortran_order': False, 'shape': (3,)}",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (3,",
        "{'shape': (3,)}",
        "'''",
        "",
        200 * "(",
    ],
)
def test_array_headers_that_lie(tmp_path: Path, text: str) -> None:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("voltages.npy", header(text))
    assert "holds an array that cannot be read" in refused(tmp_path / "x.npz", file.getvalue())


def test_encrypted(tmp_path: Path) -> None:
    content = bytearray(whole())
    content[content.find(b"PK\x03\x04") + 6] |= 1
    content[content.find(b"PK\x01\x02") + 8] |= 1
    assert "encrypted" in refused(tmp_path / "x.npz", bytes(content))


def test_a_compression_of_the_future(tmp_path: Path) -> None:
    content = bytearray(whole())
    content[content.find(b"PK\x03\x04") + 8] = 99
    content[content.find(b"PK\x01\x02") + 10] = 99
    assert "cannot be read" in refused(tmp_path / "x.npz", bytes(content))


def test_a_bomb_is_refused_unopened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tomoskin.core.user_files, "machine_memory", lambda: 3600)
    message = refused(tmp_path / "x.npz", whole())  # 80 numbers, and 80 that are bytes in the file
    assert "takes 0.0 GiB, more than a quarter of this machine's 0.0 GiB" in message
    monkeypatch.setattr(tomoskin.core.user_files, "machine_memory", lambda: 5120)
    assert load_arrays(tmp_path / "x.npz")["drive"].shape == (40, 2)


def test_what_is_not_asked_for_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    np.savez_compressed(path, names=np.arange(3), zeros=np.zeros(1 << 21))
    tracemalloc.start()
    try:
        assert set(load_arrays(path)) == {"names", "zeros"}
        assert load_arrays(path)["names"].tolist() == [0, 1, 2]
        assert tracemalloc.get_traced_memory()[1] < 2 << 20
    finally:
        tracemalloc.stop()


def test_members_that_are_no_arrays_are_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(DataError, match=r"expected an interchange file .*, got the keys readme"):
        read_recording(path)


def test_an_empty_archive(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    with zipfile.ZipFile(path, "w"):
        pass
    with pytest.raises(DataError, match="of an empty archive"):
        read_recording(path)
