"""matplotlib, an extra (``plot``), where there is one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin.core import DataError, StrPath, install_hint, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARGIN = 0.12
"""Empty rim of a picture and of each of its panels, inch: titles keep off the edge."""


def new_figure(path: StrPath, width: float, height: float) -> Figure:
    """Empty figure of that size in inches, for the file ``path``.

    Raises DataError when matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
        from matplotlib.layout_engine import ConstrainedLayoutEngine
    except ImportError as error:
        raise DataError(
            "pictures need matplotlib", where=str(path), hint=install_hint("plot")
        ) from error
    layout = ConstrainedLayoutEngine(h_pad=_MARGIN, w_pad=_MARGIN, hspace=0.0, wspace=0.0)
    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def save_figure(path: StrPath, figure: Figure, *, overwrite: bool = False) -> None:
    """Write ``figure`` as the ending of ``path`` says.

    Raises DataError for an ending that is not known, and as :func:`written` does.
    """
    path = Path(path)
    try:
        with written(path, overwrite=overwrite) as part:
            figure.savefig(part, dpi=120, format=path.suffix[1:].lower() or "png")
    except ValueError as error:
        raise DataError(f"cannot be written: {error}", where=str(path)) from error
