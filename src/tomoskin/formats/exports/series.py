"""Images over time as a series for ParaView: a .pvd that lists one .vtu a moment."""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from xml.etree import ElementTree as Xml

from tomoskin.core import FloatArray, Output, check_outputs, written
from tomoskin.formats.vtu import write_vtu
from tomoskin.mesh import Mesh


def series_files(path: Path) -> list[Path]:
    """``path`` (.pvd), and the parts of a series of its name that are there."""
    part = re.compile(rf"{re.escape(path.stem)}_\d{{6,}}\.vtu")
    beside = path.parent.iterdir() if path.parent.is_dir() else ()
    return [path, *sorted(file for file in beside if part.fullmatch(file.name))]


def write_series(
    path: Path,
    mesh: Mesh,
    moments: Iterable[tuple[float, FloatArray]],
    *,
    overwrite: bool = False,
) -> int:
    """Write ``path`` (.pvd) and the files beside it, one a (time s, values (n_cells,)).

    Returns the number of them; the field is called ``change``. All appear at the end, ``path``
    last. Raises as :func:`written` does, for each of :func:`series_files`.
    """
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
