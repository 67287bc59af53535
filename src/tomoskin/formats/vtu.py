"""Images on their mesh as a VTK unstructured grid, for ParaView and friends."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, written
from tomoskin.mesh import Mesh

_VTK_TYPE = {3: 5, 4: 10}
_VTK_NAME = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}


def write_vtu(
    path: Path, mesh: Mesh, fields: Mapping[str, FloatArray], *, overwrite: bool = False
) -> None:
    """Write ``fields``, each (n_cells,), as cell data of ``mesh``; raises as :func:`written`."""
    document = _document(mesh, fields)
    with written(path, overwrite=overwrite) as part:
        document.write(part, encoding="utf-8", xml_declaration=True)


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
