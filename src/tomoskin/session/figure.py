"""matplotlib, an extra (``plot``), where there is one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from tomoskin.core import DataError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def new_figure(path: Path, width: float, height: float) -> Figure:
    """Empty figure of that size in inches, for the file ``path``.

    Raises DataError when matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise DataError(
            "pictures need matplotlib", where=str(path), hint="pip install 'tomoskin[plot]'"
        ) from error
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_figure(path: Path, figure: Figure) -> None:
    """Write ``figure`` as the ending of ``path`` says.

    Raises DataError when that cannot be done.
    """
    try:
        figure.savefig(path, dpi=120)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise DataError(f"cannot be written: {reason}", where=str(path)) from error
