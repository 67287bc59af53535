"""Wavefront .obj, Stanford .ply and .stl files, as programs write them: polygons of any number of
corners. Readers of others cover a concave polygon wrongly, or read a part of what is valid."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.mesh.facets import triangulated


class Block(NamedTuple):
    """Cells of one ``type``, ``data`` (n, corners)."""

    type: str
    data: IntArray


@dataclass(frozen=True, eq=False)
class Facets:
    """Points (n, 3) and triangles of a file, by meshio's names of what a file may hold."""

    points: FloatArray
    cells: list[Block]
    cell_sets: dict[str, Any] = field(default_factory=dict)
    cell_data: dict[str, Any] = field(default_factory=dict)
    field_data: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, points: FloatArray, polygons: Iterable[Sequence[int]]) -> Facets:
        """Those of polygons; ValueError for one of a point that does not exist."""
        listed = list(polygons)
        for polygon in listed:
            if min(polygon, default=0) < 0 or max(polygon, default=0) >= len(points):
                raise ValueError(
                    f"a face has the corners {list(polygon)}, and the file has {len(points)} points"
                )
        return cls(points, [Block("triangle", triangulated(points, listed))])


def joined(corners: FloatArray) -> Facets:
    """Triangles (n, 3, 3) whose corners at one place are one point."""
    places = corners.reshape(-1, 3)
    _, first, number = np.unique(places, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    cells = rank[number.reshape(-1)].reshape(-1, 3).astype(np.int64)
    return Facets(places[first[order]], [Block("triangle", cells)])


def read_obj(file: Path) -> Facets:
    """Vertices and faces; whatever else there is says nothing of the shape.

    A face names each corner by its vertex, perhaps with its texture and its normal behind slashes;
    negative numbers count back from the last vertex so far. ValueError names a wrong line.
    """
    points: list[list[float]] = []
    polygons: list[list[int]] = []
    for number, line in _whole_lines(file):
        key, *words = line.split()
        try:
            if key == "v":
                points.append([float(word) for word in words[:3]])
            elif key == "f":
                corners = [int(word.partition("/")[0]) for word in words]
                polygons.append([c - 1 if c > 0 else len(points) + c for c in corners])
                if 0 in corners:
                    raise ValueError("corners count from 1")
        except ValueError as error:
            raise ValueError(f'line {number}: "{line[:60]}": {error}') from None
        if (key == "v" and len(points[-1]) < 3) or (key == "f" and len(words) < 3):
            raise ValueError(f'line {number}: expected three or more values, got "{line[:60]}"')
    return Facets.of(np.array(points, dtype=np.float64).reshape(-1, 3), polygons)


def _whole_lines(file: Path) -> Iterator[tuple[int, str]]:
    """Lines without comments that hold something, those that a backslash continues as one."""
    begun = ""
    with file.open(encoding="utf-8", errors="replace") as lines:
        for number, line in enumerate(lines, start=1):
            text = begun + line.partition("#")[0].rstrip()
            if text.endswith("\\"):
                begun = text[:-1] + " "
                continue
            begun = ""
            if text.strip():
                yield number, text.strip()


_STL_HEAD, _STL_COUNT = 80, 4
_STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("extra", "<u2")])


def read_stl(file: Path) -> Facets:
    """Binary where the size says so, else text in small or capital letters. ValueError."""
    data = file.read_bytes()
    count = int.from_bytes(data[_STL_HEAD : _STL_HEAD + _STL_COUNT], "little")
    begin = _STL_HEAD + _STL_COUNT
    if len(data) == begin + count * _STL_FACET.itemsize:
        return joined(np.frombuffer(data, _STL_FACET, count, begin)["corners"].astype(np.float64))
    if not data[:_STL_HEAD].lstrip().lower().startswith(b"solid"):
        raise ValueError(
            f"expected {count} triangles in {begin + count * _STL_FACET.itemsize} bytes, "
            f"got {len(data)}"
        )
    words = [line.split() for line in data.decode("utf-8", "replace").splitlines()]
    corners = [[float(w) for w in line[1:4]] for line in words if line[:1] and _is_vertex(line)]
    loops = sum(line[0].lower() == "endfacet" for line in words if line)
    if len(corners) != 3 * loops:
        raise ValueError(f"expected 3 corners for each of {loops} facets, got {len(corners)}")
    return joined(np.array(corners, dtype=np.float64).reshape(-1, 3, 3))


def _is_vertex(words: list[str]) -> bool:
    return words[0].lower() == "vertex"


_PLY_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_PLY_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass
class _Element:
    """What a header says of one: properties by name, with the type of a list's length."""

    name: str
    count: int
    properties: dict[str, tuple[str | None, str]] = field(default_factory=dict)


def read_ply(file: Path) -> Facets:
    """Vertices and faces, text or binary of either order; other elements are passed over.

    ValueError says what of the header, or of the faces, is not as it should be.
    """
    with file.open("rb") as stream:
        order, elements = _ply_header(stream)
        body = stream.read()
    columns = _ply_text(body, elements) if not order else _ply_binary(body, elements, order)
    vertex, face = columns.get("vertex", {}), columns.get("face", {})
    if not vertex.keys() >= {"x", "y", "z"}:
        raise ValueError(f"expected vertices with x, y and z, got {', '.join(vertex) or 'none'}")
    points = np.column_stack([np.asarray(vertex[axis], np.float64) for axis in "xyz"])
    corners = next((face[name] for name in _CORNERS if name in face), ())
    return Facets.of(points, [np.asarray(row, np.int64).tolist() for row in corners])


def _ply_header(stream: Any) -> tuple[str, list[_Element]]:
    order: str | None = None
    elements: list[_Element] = []
    if (first := stream.readline(80).strip()) != b"ply":
        raise ValueError(f'expected "ply" in the first line, got {first!r}')
    for raw in stream:
        match raw.decode("ascii", "replace").split():
            case ["end_header"]:
                break
            case ["format", kind, *_]:
                order = _PLY_ORDERS.get(kind)
            case ["element", name, count]:
                elements.append(_Element(name, int(count)))
            case ["property", "list", length, kind, name]:
                elements[-1].properties[name] = _PLY_TYPES[length], _PLY_TYPES[kind]
            case ["property", kind, name]:
                elements[-1].properties[name] = None, _PLY_TYPES[kind]
            case _:
                pass  # comments
    else:
        raise ValueError(f'expected "end_header" after {len(elements)} elements, got the end')
    if order is None:
        raise ValueError(f"expected a format among {', '.join(_PLY_ORDERS)}, got another")
    return order, elements


Columns = dict[str, dict[str, Any]]


def _ply_text(body: bytes, elements: list[_Element]) -> Columns:
    words, at = body.split(), 0
    columns: Columns = {}
    for element in elements:
        rows: dict[str, list[Any]] = {name: [] for name in element.properties}
        for _ in range(element.count):
            for name, (length, _kind) in element.properties.items():
                count = 1
                if length is not None:
                    count, at = int(words[at]), at + 1
                values = [float(word) for word in words[at : at + count]]
                if len(values) < count or at >= len(words) > 0 < count:
                    raise ValueError(f"the file ends within its {element.name} elements")
                rows[name].append(values if length is not None else values[0])
                at += count
        columns[element.name] = rows
    return columns


def _ply_binary(body: bytes, elements: list[_Element], order: str) -> Columns:
    columns: Columns = {}
    at = 0
    for element in elements:
        fixed = _fixed_rows(body, at, element, order)
        if fixed is None:
            columns[element.name], at = _ply_rows(body, at, element, order)
        else:
            columns[element.name] = {n: fixed[n] for n in element.properties}
            at += fixed.nbytes
    return columns


def _fixed_rows(body: bytes, at: int, element: _Element, order: str) -> NDArray[Any] | None:
    """All rows at once, where lists are as long in each as in the first; else None."""
    lengths: dict[str, int] = {}
    place = at
    layout: list[tuple[str, DTypeLike] | tuple[str, DTypeLike, int]] = []
    for name, (length, kind) in element.properties.items():
        count = 1
        if length is not None:
            lengths[name] = count = _number(body, place, order + length) if element.count else 0
            layout += [(f"# {name}", order + length), (name, order + kind, count)]
            place += np.dtype(length).itemsize
        else:
            layout.append((name, order + kind))
        place += count * np.dtype(kind).itemsize
    rows = (
        np.frombuffer(body, np.dtype(layout), element.count, at)
        if _holds(body, at, np.dtype(layout).itemsize * element.count)
        else None
    )
    if rows is None and not lengths:
        raise ValueError(f"the file ends within its {element.name} elements")
    if rows is None or any((rows[f"# {name}"] != n).any() for name, n in lengths.items()):
        return None
    return rows


def _holds(body: bytes, at: int, size: int) -> bool:
    return at + size <= len(body)


def _ply_rows(body: bytes, at: int, element: _Element, order: str) -> tuple[dict[str, Any], int]:
    """Rows one by one, and where they end."""
    rows: dict[str, list[Any]] = {name: [] for name in element.properties}
    for _ in range(element.count):
        for name, (length, kind) in element.properties.items():
            count = 1
            if length is not None:
                count, at = _number(body, at, order + length), at + np.dtype(length).itemsize
            dtype = np.dtype(order + kind)
            values = np.frombuffer(body, dtype, count, at)
            rows[name].append(values if length is not None else values[0])
            at += count * dtype.itemsize
    return rows, at


def _number(body: bytes, at: int, kind: str) -> int:
    return int(np.frombuffer(body, kind, 1, at)[0])
