"""A sheet of images with their touches, drawn by matplotlib (extra ``plot``)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import CHANGE, DataError, FloatArray, Image, Touch
from tomoskin.formats.display import Display
from tomoskin.formats.figure import new_figure, save_figure
from tomoskin.mesh import Mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS = 16
_MM = 1e3


@dataclass(frozen=True, eq=False)
class Panel:
    """One image: ``values`` (n_cells,), its touches, and what to write above it."""

    title: str
    values: FloatArray
    touches: tuple[Touch, ...]


def write_picture(
    path: Path,
    mesh: Mesh,
    panels: Sequence[Panel],
    unit: str,
    limit: float | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Draw at most ``MOST_PANELS`` panels on one symmetric colour scale, and save them.

    Parameters
    ----------
    unit
        Of the values; "relative" is drawn in per cent.
    limit
        End of the colour scale, in that unit; without it, the greatest value.

    Raises
    ------
    DataError
        When matplotlib is not installed or the mesh is a volume, and as :func:`written` does.
    """
    save_figure(path, _figure(path, mesh, panels, unit, limit), overwrite=overwrite)


def plot(
    image: Image,
    mesh: Mesh,
    *,
    touches: Sequence[Touch] = (),
    title: str = "",
    display: Display | None = None,
) -> Figure:
    """Draw ``image`` on its ``mesh`` as a matplotlib figure, which a notebook shows by itself.

    Raises
    ------
    DataError
        When matplotlib is not installed, the image is of another mesh, or the mesh is a volume.
    """
    how = Display() if display is None else display
    shown = how.shown(image, mesh)
    panel = Panel(title, shown.values, tuple(touches))
    return _figure(Path("plot"), mesh, [panel], shown.unit, how.limit)


def rendered(path: Path, mesh: Mesh, panel: Panel, unit: str, limit: float) -> NDArray[np.uint8]:
    """One panel as pixels (h, w, 3), for the film ``path``; raises as :func:`write_picture`."""
    canvas: Any = _figure(path, mesh, [panel], unit, limit).canvas
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


def _figure(
    path: Path, mesh: Mesh, panels: Sequence[Panel], unit: str, limit: float | None
) -> Figure:
    if mesh.dimension != 2:
        raise DataError(
            "a volume cannot be drawn as a sheet",
            where=str(path),
            hint="take a slice with mesh.pixels(z=…), or write a .vtu file",
        )
    columns = min(len(panels), 4)
    rows = -(-len(panels) // columns)
    figure = new_figure(path, 3.2 * columns + 1.1, 3.3 * rows)
    factor, label = (100.0, "%") if unit == "relative" else (1.0, unit)
    greatest = max(float(np.abs(p.values).max()) for p in panels)
    end = factor * (limit or greatest or 1.0)
    axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
    for ax, panel in zip(axes, panels, strict=False):
        drawn = _draw(ax, mesh, replace(panel, values=factor * panel.values), end)
    for ax in axes[len(panels) :]:
        ax.set_visible(False)
    figure.colorbar(
        drawn,
        ax=list(axes),
        label=f"change of conductivity ({label})",
        shrink=0.8,
        extend="both" if factor * greatest > end * (1 + 1e-9) else "neither",
    )
    return figure


def _draw(ax: Axes, mesh: Mesh, panel: Panel, limit: float) -> Any:
    x, y = _MM * mesh.points[:, :2].T
    colours = CHANGE.colormap()
    drawn = ax.tripcolor(
        x, y, mesh.cells, facecolors=panel.values, cmap=colours, vmin=-limit, vmax=limit
    )
    for number, facets in enumerate(mesh.electrodes, start=1):
        middle = _MM * mesh.points[np.unique(facets)][:, :2].mean(axis=0)
        ax.plot(*middle, "s", color="0.25", markersize=2.5)
        x_label, y_label = 1.09 * middle
        ax.text(x_label, y_label, f"E{number}", fontsize=6, color="0.3", ha="center", va="center")
    for touch in panel.touches:
        place = (_MM * touch.detection.x, _MM * touch.detection.y)
        ax.plot(*place, "+", color="black", markersize=9, markeredgewidth=1.2)
        label = f"{place[0]:.0f}, {place[1]:.0f}"
        ax.annotate(label, place, xytext=(5, 5), textcoords="offset points", fontsize=7)
    ax.set_title(panel.title, fontsize=9)
    ax.set_aspect("equal")
    ax.set_xlabel("mm", fontsize=7)
    ax.tick_params(labelsize=6)
    ax.margins(0.09)
    return drawn
