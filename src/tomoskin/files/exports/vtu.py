"""Images on their mesh for ParaView: a VTK unstructured grid, or a series of them over time."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, Output, StrPath, check_outputs, written
from tomoskin.model.mesh import Mesh

_HEAD = "<?xml version='1.0' encoding='utf-8'?>\n"
_SERIES = _HEAD + '<VTKFile type="Collection" version="1.0"><Collection>{}</Collection></VTKFile>'
_GRID = (
    _HEAD + '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" '
    'header_type="UInt64"><UnstructuredGrid>'
    '<Piece NumberOfPoints="{n_points}" NumberOfCells="{n_cells}">'
    "<Points>{points}</Points><Cells>{cells}</Cells><CellData>{data}</CellData>"
    "</Piece></UnstructuredGrid></VTKFile>"
)
_VTK_TYPE = {3: 5, 4: 10}
_VTK_NAME = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}


def write_vtu(
    path: StrPath, mesh: Mesh, fields: Mapping[str, FloatArray], *, overwrite: bool = False
) -> None:
    """Write ``fields``, each (n_cells,), as cell data of ``mesh``; raises as :func:`written`."""
    text = _document(mesh, fields)
    with written(path, overwrite=overwrite) as part:
        part.write_text(text, encoding="utf-8")


def series_files(path: StrPath) -> list[Path]:
    """``path`` (.pvd), and the parts of a series of its name that are there."""
    path = Path(path)
    part = re.compile(rf"{re.escape(path.stem)}_\d{{6,}}\.vtu")
    neighbours = path.parent.iterdir() if path.parent.is_dir() else ()
    return [path, *sorted(file for file in neighbours if part.fullmatch(file.name))]


def write_series(
    path: StrPath,
    mesh: Mesh,
    moments: Iterable[tuple[float, Mapping[str, FloatArray]]],
    *,
    overwrite: bool = False,
) -> int:
    """Write ``path`` (.pvd) and the files beside it, one a (time s, fields, each (n_cells,)).

    Returns the number of them. All appear at the end, ``path`` last. Raises as :func:`written`
    does, for each of :func:`series_files`.
    """
    path = Path(path)
    check_outputs(map(Output, series_files(path)), overwrite=overwrite)
    entries, count = [], 0
    with ExitStack() as files:
        target = files.enter_context(written(path, overwrite=overwrite))
        for count, (time, fields) in enumerate(moments, start=1):
            name = f"{path.stem}_{count:06d}.vtu"
            part = files.enter_context(written(path.with_name(name), overwrite=overwrite))
            write_vtu(part, mesh, fields, overwrite=True)
            entries.append(f'<DataSet timestep="{time:.6f}" part="0" file={quoteattr(name)} />')
        target.write_text(_SERIES.format("".join(entries)), encoding="utf-8")
    return count


def _document(mesh: Mesh, fields: Mapping[str, FloatArray]) -> str:
    n_points, n_cells, corners = len(mesh.points), *mesh.cells.shape
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.points.shape[1])))
    types = np.full(n_cells, _VTK_TYPE[corners], dtype=np.uint8)
    return _GRID.format(
        n_points=n_points,
        n_cells=n_cells,
        points=_array("points", points),
        cells=_array("connectivity", mesh.cells.ravel())
        + _array("offsets", corners * np.arange(1, n_cells + 1))
        + _array("types", types),
        data="".join(_array(name, values) for name, values in fields.items()),
    )


def _array(name: str, values: NDArray[Any]) -> str:
    raw = np.ascontiguousarray(values).tobytes()
    data = base64.b64encode(np.uint64(len(raw)).tobytes() + raw).decode("ascii")
    kind, count = _VTK_NAME[values.dtype.name], values.shape[1] if values.ndim == 2 else 1
    return (
        f'<DataArray Name={quoteattr(name)} type="{kind}" format="binary" '
        f'NumberOfComponents="{count}">{data}</DataArray>'
    )
