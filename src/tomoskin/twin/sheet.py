"""The twin's sheet: presses and time → conductivity → resistance between the electrodes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel, Terminals
from tomoskin.model.mesh import Outline, Plane, Surface, laid_on, triangulate
from tomoskin.model.skin import Skin
from tomoskin.twin import material
from tomoskin.twin.bend import Pose, depth_of, strain_of
from tomoskin.twin.dent import depth_under, indent
from tomoskin.twin.material import MaterialState
from tomoskin.twin.presets import TwinSettings
from tomoskin.twin.probe import Probe, check_on_skin

_MESH_SEED = 7919
"""Seed of the twin's mesh; the reconstruction's is another, so no mesh is ever shared."""

_FEW = 0.04
"""Up to this part of the cells a local update is faster than a new solve: 29 µs for 36 of 3,000
and 43 for 108 of 12,000, where the whole sheet takes 100 and 610 (16 electrodes, native engine)."""

_SAME = 1e-9
"""A conductivity that has changed by no more than this part anywhere is not solved again."""

_FIRST = 64
"""One cell of so many is compared first."""


_Under = tuple[tuple[tuple[Probe, ...], FloatArray], tuple[Pose, FloatArray]]
"""What presses on the sheet, and how it is bent: each with what the cells feel of it alone."""


class _Loading:
    """What presses on a sheet, how it is bent, and what its cells feel; each is solved once."""

    def __init__(
        self, points: FloatArray, blur: float, outline: Outline, rest: Surface, given: TwinSettings
    ) -> None:
        self._points, self._outline = points, outline
        self.ground = given.contact, points, blur
        self._shape = points, rest, given.bend.height
        nothing = np.zeros((4, len(points)))
        self.at_rest: _Under = ((), nothing), ((), nothing[:3])
        self.now: _Under = self.at_rest
        self._felt: tuple[_Under, FloatArray] = self.now, nothing

    def press(self, presses: tuple[Probe, ...]) -> None:
        """Replace all presses; GeometryError when one is off the skin or its face cannot press."""
        check_on_skin(presses, self._outline)
        if presses != self.now[0][0]:
            taken = tuple(presses)
            self.now = (taken, indent(taken, *self.ground)), self.now[1]

    def bend(self, pose: Pose) -> None:
        """Bend and stretch; GeometryError when the sheet cannot take that shape."""
        if pose != self.now[1][0]:
            taken = tuple(pose)
            self.now = self.now[0], (taken, strain_of(taken, *self._shape).T)

    @property
    def load(self) -> FloatArray:
        """(4, n_cells) strain xx, yy, xy and depth, m, that the cells feel now."""
        under = (_, load), (pose, strain) = self.now
        if not _same(under, self._felt[0]):
            if pose:
                load = load.copy()
                load[:3] += strain
                load[3] += depth_of(pose, self._points)
            self._felt = under, load
        return self._felt[1]


class _Network:
    """The resistance between electrodes, solved again only when the conductivity has changed."""

    def __init__(self, model: ForwardModel, unloaded: FloatArray) -> None:
        self.base, self._terminals = model.at(unloaded), Terminals(model)
        self._sigma: FloatArray = np.empty(0)
        self._under: tuple[object, object] = (None, None)
        self._resistance: FloatArray = np.empty((0, 0))
        self.solves = 0

    def resistance(self, sigma: FloatArray, under: _Under) -> FloatArray:
        """(n_electrodes, n_electrodes) Ω at ``sigma``, which what presses has made."""
        if sigma is self._sigma:
            return self._resistance
        if not _same(under, self._under) or _changed(self._sigma, sigma):
            self._resistance = self._solved(sigma)
            self.solves += 1
            self._sigma, self._under = sigma, under
        return self._resistance

    def _solved(self, sigma: FloatArray) -> FloatArray:
        """Exact either way: by the local update where few cells differ from the sheet at rest."""
        if sigma.ndim == 1:
            cells = np.flatnonzero(sigma != self.base.conductivity)
            if 0 < len(cells) <= _FEW * len(sigma):
                (changed,) = self.base.local.transfer_resistances_of([(cells, sigma[cells])])
                return np.asarray(changed)
        return np.asarray(self._terminals.transfer_resistance(sigma))


class TwinSkin:
    """A sheet with electrodes on a mesh of its own.

    It is solved again only when its conductivity has changed.
    """

    def __init__(
        self,
        model: ForwardModel,
        outline: Outline,
        conductivity: float,
        settings: TwinSettings,
        rest: Surface | None = None,
    ) -> None:
        """``conductivity`` of the sheet at rest, S; ``model`` on the twin's own mesh.

        ``rest`` is what the sheet lies on at rest, and the mesh too.
        """
        self.model, self.material = model, settings.material
        points = np.asfortranarray(model.mesh.centroids)  # columns are read, not rows
        blur = math.sqrt(float(model.mesh.volumes.mean())) / math.sqrt(12)
        self._loading = _Loading(points, blur, outline, rest or Plane(), settings)
        spread, self._random = (
            np.random.default_rng(part) for part in np.random.SeedSequence(settings.seed).spawn(2)
        )
        self._unloaded = conductivity * material.spread_over(self.material, points, spread)
        self._network = _Network(model, self._unloaded)
        self._stood = self._loading.now
        self._state = MaterialState.fresh(self.material, len(points))
        self._conductivity: FloatArray | None = None

    @classmethod
    def of(cls, skin: Skin, settings: TwinSettings) -> Self:
        """The twin of a skin, on a finer mesh from another seed."""
        cells = round(settings.mesh_ratio * skin.mesh_cells)
        flat = triangulate(skin.outline, skin.arcs, cells, seed=_MESH_SEED)
        mesh = laid_on(flat, skin.surface)
        model = ForwardModel(
            mesh, skin.pattern(), contact_impedance=skin.contact_impedance, current=skin.current
        )
        return cls(model, skin.outline, skin.conductivity, settings, skin.surface)

    @property
    def n_electrodes(self) -> int:
        """The number of electrodes on the sheet."""
        return self.model.pattern.n_electrodes

    @property
    def solves(self) -> int:
        """How often the resistance has been solved."""
        return self._network.solves

    @property
    def presses(self) -> tuple[Probe, ...]:
        """What presses on the sheet now."""
        return self._loading.now[0][0]

    @property
    def pose(self) -> Pose:
        """How the sheet is bent and stretched now."""
        return self._loading.now[1][0]

    def depth_under(self, probe: Probe) -> float:
        """M by which the sheet gives way under a ``probe`` that presses alone."""
        contact, _, blur = self._loading.ground
        return depth_under(probe, contact, blur)

    @property
    def load(self) -> FloatArray:
        """(4, n_cells) strain xx, yy, xy and depth, m, under the present presses and pose."""
        return self._loading.load

    def set_presses(self, presses: tuple[Probe, ...]) -> None:
        """Replace all presses at once, from any thread; they are solved here.

        Raises
        ------
        GeometryError
            When the centre of one is off the skin, or its face cannot press; then nothing is
            changed.
        """
        self._loading.press(presses)

    def set_pose(self, pose: Pose) -> None:
        """Bend and stretch the sheet, from any thread; ``()`` lets it lie as at rest.

        Raises
        ------
        GeometryError
            When it cannot take that shape; then nothing is changed.
        """
        self._loading.bend(pose)

    def advance(self, dt: float) -> None:
        """Let ``dt`` s go by under the present presses; any step is exact.

        Raises
        ------
        ModelError
            When dt is negative or not finite.
        """
        now = self._loading.now
        settled = _same(now, self._stood) and (self.material.still or dt == 0)
        if settled and self._conductivity is not None and dt >= 0:
            return
        self._stood = now
        chance = self._random.standard_normal() if self.material.temperature_sd > 0 else 0.0
        step = self._state, self.material, self.load, dt, chance
        self._state, self._conductivity = material.stepped(*step, unloaded=self._unloaded)

    def renew(self, chance: np.random.SeedSequence | None = None) -> None:
        """Forget all presses, bends and their past: a sheet that nothing has touched.

        Its spread stays. ``chance``, if given, is where its temperature begins again.
        """
        if chance is not None:
            self._random = np.random.default_rng(chance)
        self._loading.now = self._stood = self._loading.at_rest
        self._state = MaterialState.fresh(self.material, len(self._unloaded))
        self._conductivity = None

    def warm(self, kelvin: float) -> None:
        """Make the whole sheet warmer by ``kelvin``, at once."""
        self._state = replace(self._state, warmer=self._state.warmer + kelvin)
        self._conductivity = None

    def conductivity(self) -> FloatArray:
        """(n_cells,) S now, or (n_cells, 2, 2) where directions differ."""
        self.advance(0.0)
        assert self._conductivity is not None
        return self._conductivity

    def resistance(self) -> FloatArray:
        """(n_electrodes, n_electrodes) Ω now.

        The same array as before unless the conductivity has changed.
        """
        sigma = self.conductivity()
        return self._network.resistance(sigma, self._loading.now)


def _changed(old: FloatArray, new: FloatArray) -> bool:
    """Whether conductivities differ anywhere; a few cells are asked first, as most have moved."""
    if old.shape != new.shape:
        return True
    for part in (slice(None, None, _FIRST), slice(None)):
        if np.abs(new[part] - old[part]).max() > _SAME * np.abs(new[part]).min():
            return True
    return False


def _same(some: tuple[object, object], others: tuple[object, object]) -> bool:
    return some[0] is others[0] and some[1] is others[1]
