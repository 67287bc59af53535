"""How far off a fitted touch is, over the sheet, against the least possible error.

A flat probe of 12 mm presses with 3 N at 91 places of `textile-disc-8` and `textile-disc-16`, six
frames each. The sheet is the twin's, on a mesh of its own and with the profile of a rigid probe;
the board has ten bits. Each frame is fitted alone, on the sheet that the reference shows. The bound
is that of Cramér and Rao for the twin itself, where position, force and radius are unknown.

Shown: for either skin the bound, the root mean square error of the fit, and the fit in parts of the
bound.
Thesis saw: nothing of the kind; its touches come from the image.
Checked: all touches are found, and over all places the fit is at most 1.5 times as far off as the
bound.
Assumed: the twin's sheet and board. That the fit comes so near to the bound rests on a press whose
profile and noise the model nearly has; a plant of another kind is in the benchmarks.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from matplotlib.figure import Figure

import figures
from bodies import options_of
from lab import report
from tomoskin.core import FloatArray
from tomoskin.learning import Differences, FrameView
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.pipeline.finding import finder_of
from tomoskin.pipeline.frame_subspace import JUMP
from tomoskin.pipeline.rest import tuned_sheet
from tomoskin.sensing.fit import Whitener, row_covariance
from tomoskin.sensing.signal import Reference
from tomoskin.twin import Press, TwinSettings, TwinSkin

SKINS = ("textile-disc-8", "textile-disc-16")
RINGS, INSIDE = 5, 0.085
"""Rings of places about the middle one, and radius of the largest, m."""

FRAMES, IDLE = 6, 30
FORCE, RADIUS = 3.0, 0.012
STEPS = (1e-3, 1e-3, 0.05 * FORCE, 0.05 * RADIUS)
"""Of x, y, force and radius, for the bound's derivatives."""

MOST = 1.5
COLUMNS = ("bound / mm", "fit, rms / mm", "fit / bound")


class Sheet:
    """A twin's sheet, the noise of its read-out, and what fits touches on it."""

    def __init__(self, name: str, seed: int) -> None:
        skin = Skin.load(name)
        self.prepared = prepare(skin.altered({"touch": {"method": "fit"}}))
        self.twin = TwinSkin.of(skin, TwinSettings.preset("ideal", seed))
        self.random = np.random.default_rng(seed)
        sample = self.prepared.readout.noise / np.sqrt(2)
        self.root = np.linalg.cholesky(row_covariance(self.prepared.scan, sample))
        self.least = Whitener.of(row_covariance(self.prepared.scan, sample * (1 + 1 / IDLE) ** 0.5))

    def exact(self, press: Press | None) -> FloatArray:
        """(n_meas,) V without noise."""
        self.twin.set_presses(() if press is None else (press,))
        return self.twin.model.voltages(self.twin.resistance())

    def frames(self, press: Press | None, count: int) -> FloatArray:
        """(count, n_meas) V as they are read."""
        noise = self.random.standard_normal((count, len(self.root)))
        return self.exact(press) + noise @ self.root.T

    @cached_property
    def reference(self) -> Reference:
        """Of idle frames."""
        return Reference.of(self.frames(None, IDLE))

    @cached_property
    def fitted(self) -> Prepared:
        """With the sheet that the reference shows, as programs fit."""
        return tuned_sheet(self.prepared, self.reference)

    def view(self, volts: FloatArray) -> FrameView:
        """What a frame shows; all voltages in proportion may jump, as they may live."""
        mean, dv = self.reference.mean, volts - self.reference.mean
        jumps, none = JUMP * mean[:, None], np.zeros(len(dv), bool)
        differences = Differences.of(dv, jumps, none)
        image, noise = self.prepared.operator(dv), self.prepared.image_noise(self.reference)
        return FrameView(0.0, image, noise, differences)

    def error(self, x: float, y: float) -> float:
        """m, root mean square over frames; infinite where a touch is missed."""
        missed = []
        for volts in self.frames(Press(x, y, FORCE, RADIUS), FRAMES):
            finder = finder_of(self.fitted, self.reference)
            found = finder.push(self.view(volts))
            missed.append(min((np.hypot(d.x - x, d.y - y) for d in found), default=np.inf))
        return float(np.sqrt(np.mean(np.square(missed))))

    def bound(self, x: float, y: float) -> float:
        """m, that no unbiased estimate from one frame goes below."""
        at, slopes = np.array([x, y, FORCE, RADIUS]), []
        for step in np.diag(STEPS):
            ends = [self.exact(Press(*(at + sign * step).tolist())) for sign in (1, -1)]
            slopes.append((ends[0] - ends[1]) / 2)
        seen = self.least(np.array(slopes))
        least = np.linalg.inv(seen @ seen.T)
        return STEPS[0] * float(np.sqrt(least[0, 0] + least[1, 1]))


def main(arguments: Sequence[str] | None = None) -> dict[str, float]:
    """Fit, check, draw; the numbers that were checked."""
    options = options_of("fit_bound", arguments, __doc__)
    places, found, maps = _places(), {}, []
    for name in SKINS:
        sheet = Sheet(name, options.seed)
        bound, error = (np.array([f(x, y) for x, y in places]) for f in (sheet.bound, sheet.error))
        rms = [float(np.sqrt(np.mean(values**2))) for values in (bound, error)]
        assert np.isfinite(error).all(), f"{name}: a touch was missed"
        assert rms[1] < MOST * rms[0], f"{name}: {rms[1] / rms[0]:.2f} times the bound"
        electrodes = len(sheet.prepared.skin.arcs)
        found[f"bound with {electrodes} electrodes, mm"] = figures.MM * rms[0]
        found[f"fit with {electrodes}, mm"] = figures.MM * rms[1]
        found[f"fit / bound with {electrodes}"] = rms[1] / rms[0]
        maps.append((sheet, bound, error))
    options.figure.save(draw(places, maps))
    return found


def draw(places: FloatArray, maps: Sequence[tuple[Sheet, FloatArray, FloatArray]]) -> Figure:
    """A row a skin: bound and error in the same colours, and their ratio."""
    made, axes = figures.figure(len(maps), 3, (7.6, 2.5 * len(maps)))
    x, y = figures.MM * places.T
    for row, (sheet, bound, error) in zip(axes, maps, strict=True):
        most = float(np.ceil(figures.MM * np.quantile([bound, error], 0.98)))
        shown = (figures.MM * bound, figures.MM * error, error / bound)
        for ax, values, title, top in zip(row, shown, COLUMNS, (most, most, 3.0), strict=True):
            levels = np.linspace(0, top, 13)
            drawn = ax.tricontourf(x, y, np.minimum(values, top), levels, cmap=figures.AMOUNTS)
            ax.plot(x, y, ".", color="0.5", markersize=1)
            figures.draw_electrodes(ax, sheet.prepared.mesh)
            ax.set_title(title)
            made.colorbar(drawn, ax=ax, shrink=0.8, ticks=np.linspace(0, top, 5))
    return made


def _places() -> FloatArray:
    """(91, 2) m, evenly over the disc."""
    found = [np.zeros((1, 2))]
    for ring in range(1, RINGS + 1):
        turn = 2 * np.pi * (np.arange(6 * ring) + 0.5 * (ring % 2)) / (6 * ring)
        found.append(INSIDE * ring / RINGS * np.column_stack([np.cos(turn), np.sin(turn)]))
    return np.concatenate(found)


if __name__ == "__main__":
    report(main())
