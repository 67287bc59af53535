"""matplotlib, an extra (``plot``), where there is one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tomoskin.core import DataError, StrPath, needed, written

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARGIN = 0.12
"""Empty rim of a picture and of each of its panels, inch: titles keep off the edge."""


def new_figure(path: StrPath, width: float, height: float) -> Figure:
    """Empty figure of that size in inches, for the file ``path``.

    Raises DataError when matplotlib is not installed.
    """
    parts = ("figure", "layout_engine", "backends.backend_agg")
    plain, layouts, canvas = (needed(f"matplotlib.{part}", "plot", path) for part in parts)
    layout = layouts.ConstrainedLayoutEngine(h_pad=_MARGIN, w_pad=_MARGIN, hspace=0.0, wspace=0.0)
    figure: Figure = plain.Figure(figsize=(width, height), layout=layout)
    canvas.FigureCanvasAgg(figure)
    return figure


def dress(ax: Any, title: str, x: str, y: str) -> None:
    """Give a plot of curves its title, the names of its axes, small numbers and a pale grid."""
    ax.set_title(title, fontsize=10)
    ax.set_xlabel(x, fontsize=8)
    ax.set_ylabel(y, fontsize=8)
    ax.tick_params(labelsize=7, which="both")
    ax.grid(alpha=0.25)


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
