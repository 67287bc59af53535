"""Images on their mesh for ParaView: a VTK unstructured grid, or a series of them over time."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, Output, StrPath, check_outputs, written
from tomoskin.model.mesh import Mesh

_VTK_TYPE = {3: 5, 4: 10}
_VTK_NAME = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}


def write_vtu(
    path: StrPath, mesh: Mesh, fields: Mapping[str, FloatArray], *, overwrite: bool = False
) -> None:
    """Write ``fields``, each (n_cells,), as cell data of ``mesh``; raises as :func:`written`."""
    document = _document(mesh, fields)
    with written(path, overwrite=overwrite) as part:
        document.write(part, encoding="utf-8", xml_declaration=True)


def series_files(path: StrPath) -> list[Path]:
    """``path`` (.pvd), and the parts of a series of its name that are there."""
    path = Path(path)
    part = re.compile(rf"{re.escape(path.stem)}_\d{{6,}}\.vtu")
    beside = path.parent.iterdir() if path.parent.is_dir() else ()
    return [path, *sorted(file for file in beside if part.fullmatch(file.name))]


def write_series(
    path: StrPath,
    mesh: Mesh,
    moments: Iterable[tuple[float, FloatArray]],
    *,
    overwrite: bool = False,
) -> int:
    """Write ``path`` (.pvd) and the files beside it, one a (time s, values (n_cells,)).

    Returns the number of them; the field is called ``change``. All appear at the end, ``path``
    last. Raises as :func:`written` does, for each of :func:`series_files`.
    """
    path = Path(path)
    check_outputs(map(Output, series_files(path)), overwrite=overwrite)
    root = Xml.Element("VTKFile", {"type": "Collection", "version": "1.0"})
    collection = Xml.SubElement(root, "Collection")
    count = 0
    with ExitStack() as files:
        listing = files.enter_context(written(path, overwrite=overwrite))
        for count, (time, values) in enumerate(moments, start=1):
            name = f"{path.stem}_{count:06d}.vtu"
            part = files.enter_context(written(path.with_name(name), overwrite=overwrite))
            write_vtu(part, mesh, {"change": values}, overwrite=True)
            entry = {"timestep": f"{time:.6f}", "part": "0", "file": name}
            Xml.SubElement(collection, "DataSet", entry)
        Xml.ElementTree(root).write(listing, encoding="utf-8", xml_declaration=True)
    return count


def _document(mesh: Mesh, fields: Mapping[str, FloatArray]) -> Xml.ElementTree[Xml.Element[str]]:
    root = Xml.Element(
        "VTKFile",
        {
            "type": "UnstructuredGrid",
            "version": "1.0",
            "byte_order": "LittleEndian",
            "header_type": "UInt64",
        },
    )
    n_points, n_cells, corners = len(mesh.points), *mesh.cells.shape
    piece = Xml.SubElement(
        Xml.SubElement(root, "UnstructuredGrid"),
        "Piece",
        {"NumberOfPoints": str(n_points), "NumberOfCells": str(n_cells)},
    )
    points = np.zeros((n_points, 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    _array(Xml.SubElement(piece, "Points"), "points", points)
    cells = Xml.SubElement(piece, "Cells")
    _array(cells, "connectivity", mesh.cells.ravel())
    _array(cells, "offsets", corners * np.arange(1, n_cells + 1))
    _array(cells, "types", np.full(n_cells, _VTK_TYPE[corners], dtype=np.uint8))
    data = Xml.SubElement(piece, "CellData")
    for name, values in fields.items():
        _array(data, name, values)
    return Xml.ElementTree(root)


def _array(parent: Xml.Element, name: str, values: NDArray[Any]) -> None:
    raw = np.ascontiguousarray(values).tobytes()
    element = Xml.SubElement(
        parent,
        "DataArray",
        {
            "Name": name,
            "type": _VTK_NAME[values.dtype.name],
            "format": "binary",
            "NumberOfComponents": str(values.shape[1] if values.ndim == 2 else 1),
        },
    )
    header = np.uint64(len(raw)).tobytes()
    element.text = base64.b64encode(header + raw).decode("ascii")
