"""Sheets that are pressed frame by frame, each frame shown to the finders of their skin."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from plant import Finger, Plant, plant_mesh
from report import Floats
from rig import Rig, far_apart
from tomoskin.core import Detection
from tomoskin.learning import Differences, FrameView
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.pipeline.finding import Finder, finding
from tomoskin.pipeline.nuisance import JUMP
from tomoskin.pipeline.tune import tuned, tuned_sheet
from tomoskin.sensing.fit import Whitener, row_covariance
from tomoskin.sensing.signal import NuisanceSubspace, Reference
from tomoskin.sensing.signal.health import Roles
from tomoskin.twin import Press

APART = 0.045
"""m between two presses at least."""

INSIDE = 0.85
"""Part of a sheet's breadth in which fingers are."""

HOLD = 1.0
"""Seconds that a press of the twin stands before it is read."""

RADII, FALLS = (0.012, 0.020), (0.15, 0.35)
CAP = {"surface": {"shape": "cap", "radius": "100 mm"}}

_SKINS: dict[str, tuple[str, dict[str, Any]]] = {
    "8": ("textile-disc-8", {}),
    "16": ("textile-disc-16", {}),
    "square 16": ("textile-square-16", {}),
    "cap 16": ("textile-disc-16", CAP),
}


@cache
def stages(name: str) -> tuple[Skin, Prepared, Prepared]:
    """A skin by its short name, prepared for both methods."""
    built_in, changes = _SKINS.get(name, (name, {}))
    skin = Skin.load(built_in).altered(changes)
    fit, image = (prepare(skin.altered({"touch": {"method": m}})) for m in ("fit", "image"))
    return skin, fit, image


@cache
def _mesh(name: str) -> Mesh:
    return plant_mesh(stages(name)[0])


class TwinLab:
    """A twin and the finders of its skin; before each frame nothing has pressed."""

    def __init__(self, name: str, preset: str, seed: int, idle: int = 20) -> None:
        self.skin, fit, image = stages(name)
        self.prepared, self.rig, self.time = fit, Rig(self.skin, preset, seed), 0.0
        self.board, self.table = self.rig.board, self.rig.table
        self.reference = Reference.of(np.array([self.volts(()) for _ in range(idle)]))
        image, on_sheet = tuned(image, self.reference), tuned_sheet(fit, self.reference)
        self.image, self.floor = image.operator, image.image_noise(self.reference)
        self.by_fit = lambda: finding(on_sheet, self.reference)
        self.by_image = lambda: finding(image, self.reference)
        noise = fit.readout.noise / np.sqrt(2) * np.sqrt(1 + 1 / idle)
        self.whiten = Whitener.of(row_covariance(fit.scan, noise))

    def volts(self, presses: Sequence[Press]) -> Floats:
        """(n_meas,) V as the board reads them."""
        self.board.sheet.renew()
        self.board.sheet.set_presses(tuple(presses))
        self.time += HOLD
        return self.prepared.readout(self.rig.at(self.time)).values

    def view(self, presses: Sequence[Press]) -> FrameView:
        """What one frame shows."""
        return self.shown(self.volts(presses) - self.reference.mean)

    def shown(self, dv: Floats) -> FrameView:
        """What all voltages have in common may jump, as it may live."""
        mean, none = self.reference.mean[:, None], np.zeros((len(dv), 0))
        excluded = np.zeros(len(dv), bool)
        differences = Differences(dv, mean, dv, none, JUMP * mean, dv, none, dv, excluded)
        return FrameView(0.0, self.image(dv), self.floor, differences)

    def found(self, presses: Sequence[Press]) -> tuple[Sequence[Detection], Sequence[Detection]]:
        """Touches by fit and by image, from a cold start."""
        view = self.view(presses)
        return self.by_fit().push(view), self.by_image().push(view)

    def exact(self, press: Press) -> Floats:
        """(n_meas,) V of the sheet without any noise."""
        sheet = self.board.sheet
        sheet.renew()
        sheet.set_presses((press,))
        sheet.advance(HOLD)
        return sheet.model.voltages(sheet.resistance())

    def information(self, press: Press) -> Floats:
        """(4, 4) Fisher's of place, force and radius, by steps of 1 mm and of a twentieth."""
        at = (press.x, press.y, press.force, press.radius)
        slopes = []
        for number, step in enumerate((1e-3, 1e-3, 0.05 * press.force, 0.05 * press.radius)):
            ends = [
                self.exact(Press(*(v + sign * step * (k == number) for k, v in enumerate(at))))
                for sign in (1, -1)
            ]
            slopes.append((ends[0] - ends[1]) / 2)  # by one step, so that all are alike in size
        white = self.whiten(np.array(slopes))
        return np.asarray(white @ white.T)

    def least(self, presses: Sequence[Press]) -> Floats:
        """(k,) m, the least root mean square errors: place, force and radius of one unknown."""
        if len(presses) > 1:
            return np.full(len(presses), np.nan)
        covariance = np.linalg.inv(self.information(presses[0]))
        return 1e-3 * np.sqrt([np.trace(covariance[:2, :2])])


class PlantLab:
    """A plant that is independent of twin and fit, its reference, and the finders of its skin."""

    def __init__(
        self, name: str, uneven: float, excluded: int | None, idle: int, seed: int
    ) -> None:
        self.skin, fit, image = stages(name)
        self.plant = Plant(self.skin, _mesh(name), uneven, seed)
        self.lost = np.zeros(self.skin.pattern().n_meas, bool)
        if excluded is not None:
            roles = Roles.of(self.skin.pattern())
            self.lost = np.asarray(roles.drives[excluded] | roles.reads[excluded])
        self._unknown = np.eye(len(self.lost))[:, self.lost]
        self.reference = Reference.of(self.plant.frames((), idle))
        self.noise = self.plant.noise(idle).without(self._unknown)
        image = tuned(image, self.reference)
        self._image = image.without_directions(self._unknown) if self.lost.any() else image
        self._nuisance = NuisanceSubspace.of(
            np.column_stack([self.reference.mean, self._unknown]), self._image.operator.precision
        )
        self._floor = self._image.image_noise(self.reference, self._nuisance)
        self._finders: tuple[Finder, Finder] = (
            finding(tuned_sheet(fit, self.reference, self.lost), self.reference),
            finding(self._image, self.reference),
        )

    def found(self, fingers: Sequence[Finger]) -> tuple[Sequence[Detection], Sequence[Detection]]:
        """Touches by fit and by image, of a frame after one in which nothing touches."""
        change = np.asarray(self.plant.frames(fingers)[0] - self.reference.mean)
        for finder in self._finders:
            finder.push(self._view(0 * change))
        fit, image = (finder.push(self._view(change)) for finder in self._finders)
        return fit, image

    def least(self, fingers: Sequence[Finger]) -> Floats:
        """(k,) m, the bound of each."""
        return self.plant.least(fingers, self.noise)

    def _view(self, change: Floats) -> FrameView:
        """What one frame shows; all voltages in proportion say nothing, as they do live."""
        dv, blind = self._nuisance(change), self._nuisance.directions
        jumps = JUMP * self.reference.mean[:, None]
        differences = Differences(
            dv, blind, change, self._unknown, jumps, change, blind, change, self.lost
        )
        return FrameView(0.0, self._image.operator(dv), self._floor, differences)


def drawn_fingers(random: np.random.Generator, skin: Skin, count: int) -> tuple[Finger, ...]:
    """Fingers at places drawn evenly over the inner part of the sheet, far enough apart."""
    rim = INSIDE * skin.outline.polyline(skin.outline.length / 200)
    low, high = rim.min(axis=0), rim.max(axis=0)
    while True:
        places = random.uniform(low, high, (count, 2))
        if far_apart(places, APART) and all(_encloses(rim, place) for place in places):
            radii, falls = random.uniform(*RADII, count), random.uniform(*FALLS, count)
            each = np.column_stack([places, radii, falls]).tolist()
            return tuple(Finger(*values) for values in each)


def _encloses(rim: Floats, point: Floats) -> bool:
    """Whether a convex ``rim`` (n, 2), counter-clockwise, goes round the point."""
    along, towards = np.roll(rim, -1, axis=0) - rim, point - rim
    return bool((along[:, 0] * towards[:, 1] >= along[:, 1] * towards[:, 0]).all())
