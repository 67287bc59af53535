"""Sheets that are pressed frame by frame, each frame shown to the finders of their skin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench_rig import Rig, far_apart
from report import Floats
from tomoskin.core import Detection, Frame
from tomoskin.learning import Differences, FrameView
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh, laid_on, triangulate
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import ReadoutSettings, Skin
from tomoskin.pipeline import Prepared, prepare
from tomoskin.pipeline.finding import Finder, finder_of
from tomoskin.pipeline.frame_subspace import JUMP
from tomoskin.pipeline.rest import tuned, tuned_sheet
from tomoskin.sensing.fit import Whitener, row_covariance
from tomoskin.sensing.signal import FIGURES, NuisanceSubspace, Readout, Reference
from tomoskin.sensing.signal.health import Roles
from tomoskin.twin import Press

CELLS, MESH_SEED = 6600, 4711
SOFT = 0.3
"""The edge of a finger falls between 1 − SOFT and 1 + SOFT of its radius."""

WAVES, LENGTHS, CELLWISE = 200, (0.025, 0.06), 0.3
"""Unevenness: cosines, range of correlation lengths in m, and the part that each cell has alone."""

RANGE = 0.85
"""Part of the converter's range that the untouched sheet takes at most, as its current is set."""

STEPS = (5e-4, 5e-4, 5e-4, 0.02)
"""Of x, y and radius, m, and of the fall, for the bound's derivatives."""


@dataclass(frozen=True)
class Finger:
    """A flat touch with a soft edge: the conductivity falls by the part ``fall``; SI units."""

    x: float
    y: float
    radius: float
    fall: float

    @property
    def parameters(self) -> tuple[float, float, float, float]:
        """In the order of :data:`STEPS`."""
        return self.x, self.y, self.radius, self.fall


class Converter:
    """What a board makes of the resistances between a sheet's electrodes: counts with noise."""

    def __init__(self, scan: Scan, readout: ReadoutSettings, random: np.random.Generator) -> None:
        self._scan, self._readout, self._random = scan, readout, random
        self.levels = 1 << readout.adc_bits

    def codes(self, resistance: Floats, current: float) -> Floats:
        """(..., n_samples) what the converter would say without noise and steps; ``resistance``
        (..., n, n) Ω."""
        drive, electrode = self._scan.drives[self._scan.sample_drive], self._scan.sample_electrode
        source, sink = drive.T
        seen = resistance[..., electrode, :] - resistance[..., sink, :]
        rows, r = np.arange(len(drive)), self._readout
        volts = current * (seen[..., rows, source] - seen[..., rows, sink])
        return np.asarray((r.gain * volts + r.offset) / r.reference_voltage * self.levels)

    def __call__(self, codes: Floats) -> NDArray[np.uint16]:
        """(n_samples,) conversions of 10 bits or so, each with its own noise, summed."""
        times = self._readout.oversampling
        noisy = codes + FIGURES.noise * self._random.standard_normal((times, len(codes)))
        counts: NDArray[np.uint16] = np.clip(np.floor(noisy), 0, self.levels - 1).sum(axis=0)
        return counts.astype(np.uint16)


class Plant:
    """A sheet that is ``uneven`` by that standard deviation of log σ, on a mesh of its own."""

    def __init__(self, skin: Skin, mesh: Mesh, uneven: float, seed: int) -> None:
        self._random = np.random.default_rng(seed)
        self.scan = Scan.of(skin.pattern())
        self._converter = Converter(self.scan, skin.readout, self._random)
        self.volts = Readout.of(self.scan, skin.readout)
        middles = mesh.points[mesh.cells].mean(axis=1)
        sigma = skin.conductivity * np.exp(uneven * uneven_field(middles, self._random))
        model = ForwardModel(mesh, skin.pattern(), skin.contact_impedance, skin.current)
        codes = self._converter.codes(model.at(sigma).transfer_resistance, skin.current)
        self._current = skin.current * min(1.0, RANGE * self._converter.levels / float(codes.max()))
        model = ForwardModel(mesh, skin.pattern(), skin.contact_impedance, self._current)
        self.state = model.at(sigma)
        self._points = np.einsum("qk,ckd->cqd", _inner_points(), mesh.points[mesh.cells])

    def frames(self, presses: Sequence[Finger], count: int = 1) -> Floats:
        """(count, n_meas) V as the read-out gives them."""
        resistance = self.state.local.transfer_resistances_of([self._pressed(presses)])[0]
        codes = self._converter.codes(resistance, self._current)
        frames = (Frame(0, 0, 0.0, 1, 0, 0, self._converter(codes)) for _ in range(count))
        return np.array([self.volts(frame).values for frame in frames])

    def scan_of(
        self, begin: Sequence[Finger], middle: Sequence[Finger], end: Sequence[Finger]
    ) -> Frame:
        """One frame of what presses at its ``begin``, ``middle`` and ``end``: drives come one after
        the other, and what they see between is a parabola's."""
        found = self.state.local.transfer_resistances_of(
            [self._pressed(presses) for presses in (begin, middle, end)]
        )
        codes = np.array([self._converter.codes(each, self._current) for each in found])
        part = self.scan.sample_drive / len(self.scan.drives)
        weights = ((2 * part - 1) * (part - 1), 4 * part * (1 - part), part * (2 * part - 1))
        counts = self._converter(np.einsum("ks,ks->s", weights, codes))
        return Frame(0, 0, 0.0, 1, 0, 0, counts)

    def least(self, presses: Sequence[Finger], noise: Whitener) -> Floats:
        """(k,) m: root mean square error of each place that no unbiased estimate goes below.

        Cramér–Rao of this very sheet; places, radii and falls of all presses are unknown.
        """
        ends = [
            [*presses[:k], _moved(presses[k], column, sign * step), *presses[k + 1 :]]
            for k in range(len(presses))
            for column, step in enumerate(STEPS)
            for sign in (1, -1)
        ]
        volts = self.state.local.voltages_of([self._pressed(end) for end in ends])
        slopes = noise((volts[::2] - volts[1::2]) / 2)  # by one step, so that all are alike in size
        covariance = np.linalg.inv(slopes @ slopes.T)
        scale = np.tile(STEPS, len(presses))
        variance = (np.diag(covariance) * scale**2).reshape(-1, 4)
        return np.asarray(np.sqrt(variance[:, :2].sum(axis=1)))

    def noise(self, idle: int) -> Whitener:
        """Of a frame less the mean of so many idle ones, by the read-out alone."""
        sample = self.volts.noise / np.sqrt(2) * np.sqrt(1 + 1 / idle)
        return Whitener.of(row_covariance(self.scan, sample))

    def _pressed(self, presses: Sequence[Finger]) -> tuple[NDArray[np.intp], Floats]:
        left = np.ones(len(self._points))
        for finger in presses:
            away = np.linalg.norm(self._points - [finger.x, finger.y], axis=2) / finger.radius
            part = np.clip((away - 1 + SOFT) / (2 * SOFT), 0.0, 1.0)
            left *= 1 - finger.fall * np.mean((1 + np.cos(np.pi * part)) / 2, axis=1)
        cells = np.flatnonzero(left != 1)
        return cells, self.state.conductivity[cells] * left[cells]


def _moved(finger: Finger, column: int, step: float) -> Finger:
    name = ("x", "y", "radius", "fall")[column]
    return replace(finger, **{name: finger.parameters[column] + step})


def uneven_field(points: Floats, random: np.random.Generator) -> Floats:
    """(n,) of unit mean square: a smooth field, and a part that differs from cell to cell."""
    low, high = np.log(LENGTHS).tolist()
    length = np.exp(random.uniform(low, high, WAVES))
    waves = random.standard_normal((WAVES, 2)) / length[:, None]
    phase = random.uniform(0, 2 * np.pi, WAVES)
    smooth = np.cos(points @ waves.T + phase).sum(axis=1) * np.sqrt(2 / WAVES)
    field = smooth + CELLWISE * random.standard_normal(len(points))
    return np.asarray(field / np.sqrt(1 + CELLWISE**2))


def _inner_points() -> Floats:
    """(7, 3) barycentric: the middle of a triangle and six about it, evenly weighed."""
    corner = np.array([[2 / 3, 1 / 6, 1 / 6], [0.1, 0.45, 0.45]])
    about = [np.roll(point, turn) for point in corner for turn in range(3)]
    return np.array([[1 / 3, 1 / 3, 1 / 3], *about])


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
    "layer 16": ("textile-disc-16", {"surface": {"layer": "3 mm"}}),
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
def sheet_mesh(name: str) -> Mesh:
    """Finer than any that is fitted on, and of another seed."""
    skin = stages(name)[0]
    return laid_on(triangulate(skin.outline, skin.arcs, CELLS, seed=MESH_SEED), skin.surface)


class TwinLab:
    """A twin and the finders of its skin; before each frame nothing has pressed."""

    def __init__(self, name: str, preset: str, seed: int, idle: int = 20) -> None:
        self.skin, fit, image = stages(name)
        self.prepared, self.rig, self.time = fit, Rig(self.skin, preset, seed), 0.0
        self.board, self.table = self.rig.board, self.rig.table
        self.reference = Reference.of(np.array([self.volts(()) for _ in range(idle)]))
        image, on_sheet = tuned(image, self.reference), tuned_sheet(fit, self.reference)
        self.image, self.floor = image.operator, image.image_noise(self.reference)
        self.by_fit = lambda: finder_of(on_sheet, self.reference)
        self.by_image = lambda: finder_of(image, self.reference)
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
        return FrameView(0.0, self.image(dv), lambda: self.floor, differences)

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
        self.plant = Plant(self.skin, sheet_mesh(name), uneven, seed)
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
            finder_of(tuned_sheet(fit, self.reference, self.lost), self.reference),
            finder_of(self._image, self.reference),
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
        return FrameView(0.0, self._image.operator(dv), lambda: self._floor, differences)


def drawn_fingers(random: np.random.Generator, skin: Skin, count: int) -> tuple[Finger, ...]:
    """Fingers at places drawn evenly over the inner part of the sheet, far enough apart."""
    rim = INSIDE * skin.outline.polyline(skin.outline.length / 200)
    low, high = rim.min(axis=0), rim.max(axis=0)
    while True:
        places = random.uniform(low, high, (count, 2))
        if far_apart(places, APART) and skin.outline.contains(places / INSIDE).all():
            radii, falls = random.uniform(*RADII, count), random.uniform(*FALLS, count)
            each = np.column_stack([places, radii, falls]).tolist()
            return tuple(Finger(*values) for values in each)
