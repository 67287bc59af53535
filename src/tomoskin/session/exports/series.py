"""Images over time as a series for ParaView: a .pvd that lists one .vtu a moment."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as Xml

from tomoskin.core import FloatArray
from tomoskin.mesh import Mesh
from tomoskin.session.vtu import write_vtu
from tomoskin.session.writer import said_of


def write_series(path: Path, mesh: Mesh, moments: Iterable[tuple[float, FloatArray]]) -> int:
    """Write ``path`` (.pvd) and the files beside it, one a (time s, values (n_cells,)).

    Returns the number of them; the field is called ``change``.

    Raises
    ------
    DataError
        When a file cannot be written.
    """
    root = Xml.Element("VTKFile", {"type": "Collection", "version": "1.0"})
    collection = Xml.SubElement(root, "Collection")
    count = 0
    for count, (time, values) in enumerate(moments, start=1):
        part = path.with_name(f"{path.stem}_{count:06d}.vtu")
        write_vtu(part, mesh, {"change": values})
        entry = {"timestep": f"{time:.6f}", "part": "0", "file": part.name}
        Xml.SubElement(collection, "DataSet", entry)
    with said_of(path):
        Xml.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return count
