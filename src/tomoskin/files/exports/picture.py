"""How images are shown to people: unit, filter and colours, none of which is ever fed to detection;
a sheet of images with their touches, drawn by matplotlib (extra ``plot``), and films of it: GIF by
Pillow, MP4 by ffmpeg where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from tomoskin.core import CHANGE, DataError, FloatArray, Image, StrPath, Touch, needed, written
from tomoskin.imaging import disc_means
from tomoskin.model.mesh import Mesh

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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


def panel_figure(
    path: StrPath, count: int, across: int, size: tuple[float, float], more: tuple[float, float]
) -> tuple[Figure, list[Axes]]:
    """Figure of so many panels, none perhaps, at most so many ``across``; and their axes.

    Each panel has that ``size``, and the figure so much ``more``: width and height in inches.
    """
    columns = max(min(count, across), 1)
    rows = max(-(-count // columns), 1)
    figure = new_figure(path, size[0] * columns + more[0], size[1] * rows + more[1])
    axes: list[Axes] = np.atleast_1d(figure.subplots(rows, columns)).ravel().tolist()
    for ax in axes[count:]:
        ax.set_visible(False)
    return figure, axes[:count]


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


MOST_PANELS = 16
_MM = 1e3


@dataclass(frozen=True, eq=False)
class Panel:
    """One image: ``values`` (n_cells,), its touches, and what to write above it."""

    title: str
    values: FloatArray
    touches: tuple[Touch, ...]


def write_picture(
    path: StrPath,
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
    sheet = _Sheet.of(str(path), mesh, panels, unit, limit)
    save_figure(path, sheet.figure(), overwrite=overwrite)


def plot(
    image: Image,
    mesh: Mesh,
    *,
    touches: Sequence[Touch] = (),
    title: str = "",
    display: Display | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw ``image`` on its ``mesh`` by matplotlib, with electrodes, touches and a colour bar.

    Parameters
    ----------
    touches
        Marked where they are, in mm.
    display
        Filter, unit and end of the colour scale; without it, the image as it is, to its extremes.
    ax
        Axes to draw on, such as one of ``pyplot.subplots()``; without them, a figure is made.

    Returns
    -------
    Figure
        The one that was drawn on; ``savefig`` writes it.

    Raises
    ------
    DataError
        When matplotlib is not installed, the image is of another mesh, or the mesh is a volume.
    """
    if not (isinstance(image, Image) and isinstance(mesh, Mesh)):
        raise DataError(
            f"expected an Image and its Mesh, got {type(image).__name__} and {type(mesh).__name__}",
            hint="give what an operator returns, or Image(values, unit, mesh.identity) of an array",
        )
    how = Display() if display is None else display
    shown = how.shown(image, mesh)
    panel = Panel(title, shown.values, tuple(touches))
    sheet = _Sheet.of("plot", mesh, [panel], shown.unit, how.limit)
    if ax is None:
        return sheet.figure()
    figure = ax.get_figure(root=True)
    assert figure is not None, "axes are part of a figure"
    figure.colorbar(sheet.draw(ax, panel), ax=ax, **sheet.bar)
    return figure


def rendered(path: StrPath, mesh: Mesh, panel: Panel, unit: str, limit: float) -> NDArray[np.uint8]:
    """One panel as pixels (h, w, 3), for the film ``path``; raises as :func:`write_picture`."""
    canvas: Any = _Sheet.of(str(path), mesh, [panel], unit, limit).figure().canvas
    canvas.draw()
    return np.array(canvas.buffer_rgba())[..., :3]


@dataclass(frozen=True, eq=False)
class _Sheet:
    """Panels on one colour scale: ``factor`` makes the values those that the scale counts."""

    name: str
    mesh: Mesh
    panels: Sequence[Panel]
    factor: float
    end: float
    bar: Mapping[str, Any]

    @classmethod
    def of(
        cls, name: str, mesh: Mesh, panels: Sequence[Panel], unit: str, limit: float | None
    ) -> _Sheet:
        if mesh.dimension != 2:
            raise DataError(
                "a volume cannot be drawn as a sheet",
                where=name,
                hint="draw a slice with mesh.pixels(z=…), or write a .vtu file",
            )
        factor, label = (100.0, "%") if unit == "relative" else (1.0, unit)
        greatest = max(float(np.abs(p.values).max()) for p in panels)
        end = factor * (limit or greatest or 1.0)
        beyond = factor * greatest > end * (1 + 1e-9)
        bar = {
            "label": f"change of conductivity ({label})",
            "shrink": 0.8,
            "extend": "both" if beyond else "neither",
        }
        return cls(name, mesh, panels, factor, end, bar)

    def figure(self) -> Figure:
        """All panels, in rows of four."""
        figure, axes = panel_figure(self.name, len(self.panels), 4, (3.2, 3.3), (1.1, 0.0))
        for ax, panel in zip(axes, self.panels, strict=True):
            drawn = self.draw(ax, panel)
        figure.colorbar(drawn, ax=figure.axes, **self.bar)
        return figure

    def draw(self, ax: Axes, panel: Panel) -> Any:
        """One panel on ``ax``; what a colour bar is made for."""
        mesh, values, end = self.mesh, self.factor * panel.values, self.end
        x, y = _MM * mesh.points[:, :2].T
        drawn = ax.tripcolor(
            x, y, mesh.cells, facecolors=values, cmap=CHANGE.colormap(), vmin=-end, vmax=end
        )
        _mark(ax, mesh, panel)
        return drawn


def _mark(ax: Axes, mesh: Mesh, panel: Panel) -> None:
    """Electrodes, touches, and what stands around them."""
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


Pictures = Iterable[NDArray[np.uint8]]


def write_gif(path: StrPath, pictures: Pictures, fps: float, *, overwrite: bool = False) -> None:
    """Write pictures (h, w, 3) as a GIF that repeats.

    Raises
    ------
    DataError
        When Pillow is missing, and as :func:`written` does.
    """
    pillow = needed("PIL.Image", "plot", path)
    images = (pillow.fromarray(figure) for figure in pictures)
    first = next(images)
    with written(path, overwrite=overwrite) as part:
        first.save(part, "GIF", save_all=True, append_images=images, duration=1e3 / fps, loop=0)


def write_mp4(path: StrPath, pictures: Pictures, fps: float, *, overwrite: bool = False) -> None:
    """Write pictures (h, w, 3) as H.264 through ffmpeg.

    Raises
    ------
    DataError
        When there is no ffmpeg or it cannot write the file, and as :func:`written` does.
    """
    program = shutil.which("ffmpeg")
    if program is None:
        raise DataError(
            "MP4 needs the program ffmpeg, which is not installed",
            where=str(path),
            hint="install ffmpeg, or export to .gif",
        )
    stream = iter(pictures)
    first = next(stream)
    height, width = first.shape[:2]
    command = [
        *(program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"),
        *("-s", f"{width}x{height}", "-r", str(fps), "-i", "-"),
        *("-pix_fmt", "yuv420p", "-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2"),
    ]
    with written(path, overwrite=overwrite) as part:
        reason = _encoded([*command, str(part)], first, stream)
        if reason:
            raise DataError(f"cannot be written: {reason}", where=str(path))


FILMS: dict[str, Callable[..., None]] = {".gif": write_gif, ".mp4": write_mp4}
"""What writes a film, by the ending of its name."""


def _encoded(command: list[str], first: NDArray[np.uint8], rest: Pictures) -> str:
    """Feed a program; why it failed, or ""."""
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        with suppress(BrokenPipeError):  # it has ended, and says why
            for picture in chain([first], rest):
                process.stdin.write(picture.tobytes())
        _, errors = process.communicate()
    if not process.returncode:
        return ""
    text = errors.decode(errors="replace").strip().splitlines()
    return text[-1] if text else f"ffmpeg ended with the code {process.returncode}"


_LARGEST = 0.25
"""An average over more than this part of the extent would show nothing."""


@dataclass(frozen=True, slots=True)
class Display:
    """Unit, filter and colour scale of an image.

    Attributes
    ----------
    conductivity
        Of the untouched sheet, S or S/m: changes are shown as a part of it ("relative", drawn
        in per cent). None shows them in S.
    smoothing
        Radius of the circular averaging filter, m; 0 for none.
    limit
        End of the symmetric colour scale, in the unit shown (0.05 is 5 %). None takes the
        greatest value.

    Raises
    ------
    DataError
        For a radius below 0, or a conductivity or limit that is not above 0.
    """

    conductivity: float | None = None
    smoothing: float = 0.0
    limit: float | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that make no picture."""
        for name in ("conductivity", "limit"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0):
                raise DataError(f"expected a {name} above 0, got {value}")
        if not (np.isfinite(self.smoothing) and self.smoothing >= 0):
            raise DataError(f"expected a radius of 0 m or more, got {self.smoothing}")

    def shown(self, image: Image, mesh: Mesh) -> Image:
        """``image`` as it is to be seen. Raises DataError when it is of another mesh."""
        if image.mesh_id != mesh.identity:
            raise DataError(
                f"the image belongs to mesh {image.mesh_id}, not to mesh {mesh.identity}"
            )
        values, unit = self.applied(image.values, mesh, image.unit)
        return Image(values, unit, image.mesh_id)

    def applied(self, values: FloatArray, mesh: Mesh, unit: str) -> tuple[FloatArray, str]:
        """Values (…, n_cells) as they are to be seen, and their unit."""
        if self.smoothing:
            values = values @ circular_average(mesh, self.smoothing).T
        if self.conductivity is None or unit == "relative":
            return values, unit
        return values / self.conductivity, "relative"


def circular_average(mesh: Mesh, radius: float) -> csr_array:
    """The thesis's display filter (its section 4.4): mean over a disc, by area.

    Returns
    -------
    (n_cells, n_cells) sparse, rows summing to one: each cell becomes the mean, weighted by
    area, of the cells whose centroids lie within ``radius`` m of its own.

    Raises
    ------
    DataError
        When the radius is not above 0, or larger than a quarter of the sheet's extent.
    """
    most = _LARGEST * float(np.ptp(mesh.points, axis=0).max())
    if not 0 < radius <= most:
        raise DataError(
            f"expected a radius above 0 and up to {1e3 * most:.3g} mm, got {1e3 * radius:.3g} mm",
            where="circular average",
        )
    return disc_means(mesh, radius)
