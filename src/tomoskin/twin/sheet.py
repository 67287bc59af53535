"""The twin's sheet: presses and time → conductivity → resistance between the electrodes."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel, State, Terminals
from tomoskin.model.mesh import Outline, Plane, Surface, laid_on, triangulate
from tomoskin.model.skin import Skin
from tomoskin.twin import material
from tomoskin.twin.bend import Pose, depth_of, strain_of
from tomoskin.twin.dent import Load, indent
from tomoskin.twin.material import MaterialState
from tomoskin.twin.presets import TwinSettings
from tomoskin.twin.probe import Contact, check_on_skin

_MESH_SEED = 7919
"""Seed of the twin's mesh; the reconstruction's is another, so no mesh is ever shared."""

_FEW = 0.04
"""Up to this part of the cells a local update is faster than a new solve: 29 µs for 36 of 3,000
and 43 for 108 of 12,000, where the whole sheet takes 100 and 610 (16 electrodes, native engine)."""

_SAME = 1e-9
"""A conductivity that has changed by no more than this part anywhere is not solved again."""

_FIRST = 64
"""One cell of so many is compared first."""


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
        self.model = model
        self.material, self.bend = settings.material, settings.bend
        self.rest = rest or Plane()
        self._outline = outline
        self._points = np.asfortranarray(model.mesh.centroids)  # columns are read, not rows
        self._blur = math.sqrt(float(model.mesh.volumes.mean())) / math.sqrt(12)
        self._ground = settings.contact, self._points, self._blur
        spread, self._random = (
            np.random.default_rng(part) for part in np.random.SeedSequence(settings.seed).spawn(2)
        )
        factors = material.spread_over(self.material, self._points, spread)
        self._unloaded = conductivity * factors
        self._base, self._terminals = model.at(self._unloaded), Terminals(model)
        n = len(self._unloaded)
        self._nothing = self._load = Load.none(n)
        self._presses: tuple[Contact, ...] = ()
        self._pose: Pose = ()
        self._loaded: tuple[object, ...] = (self._presses, self._pose)
        self._stood: tuple[object, ...] = self._loaded
        self._dented: tuple[tuple[Contact, ...], Load] = (self._presses, self._nothing)
        self._posed: tuple[Pose, FloatArray] = (self._pose, self._nothing.strain)
        self._state = MaterialState.fresh(self.material, n)
        self._conductivity: FloatArray | None = None
        self._solved_for: FloatArray = np.empty(0)
        self._solved_under: tuple[object, ...] = (None, None)
        self._resistance: FloatArray = np.empty((0, 0))
        self.solves = 0

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
        """Number of electrodes."""
        return self.model.pattern.n_electrodes

    @property
    def presses(self) -> tuple[Contact, ...]:
        """What presses on the sheet now."""
        return self._presses

    @property
    def pose(self) -> Pose:
        """How the sheet is bent and stretched now."""
        return self._pose

    @property
    def load(self) -> Load:
        """What the cells feel under the present presses, in the present pose."""
        presses, pose = self._presses, self._pose
        if not _same((presses, pose), self._loaded):
            if presses is not self._dented[0]:
                self._dented = presses, indent(presses, *self._ground)
            self._load = dented = self._dented[1]
            if pose:
                felt = dented.felt.copy()
                felt[:3] += self._strain(pose).T
                felt[3] += depth_of(pose, self._points)
                self._load = Load(felt)
            self._loaded = (presses, pose)
        return self._load

    def _strain(self, pose: Pose) -> FloatArray:
        """(n_cells, 3) of the pose alone."""
        if pose is not self._posed[0]:
            self._posed = pose, strain_of(pose, self._points, self.rest, self.bend.height)
        return self._posed[1]

    def set_presses(self, presses: tuple[Contact, ...]) -> None:
        """Replace all presses at once, from any thread; they are solved here.

        Raises
        ------
        GeometryError
            When the centre of one is off the skin, or its face cannot press; then nothing is
            changed.
        """
        check_on_skin(presses, self._outline)
        if presses != self._presses:
            taken = tuple(presses)
            self._dented = taken, indent(taken, *self._ground)
            self._presses = taken

    def set_pose(self, pose: Pose) -> None:
        """Bend and stretch the sheet, from any thread; ``()`` lets it lie as at rest.

        Raises
        ------
        GeometryError
            When it cannot take that shape; then nothing is changed.
        """
        if pose != self._pose:
            taken = tuple(pose)
            self._posed = taken, strain_of(taken, self._points, self.rest, self.bend.height)
            self._pose = taken

    def advance(self, dt: float) -> None:
        """Let ``dt`` s go by under the present presses; any step is exact.

        Raises
        ------
        ModelError
            When dt is negative or not finite.
        """
        now = (self._presses, self._pose)
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
        self._presses, self._pose = (), ()
        nothing = (self._presses, self._pose)
        self._loaded = self._stood = nothing
        self._load = self._nothing
        self._state = MaterialState.fresh(self.material, len(self._unloaded))
        self._conductivity = None

    def warm(self, kelvin: float) -> None:
        """Make the whole sheet warmer by ``kelvin``, at once."""
        self._state = replace(self._state, warmer=self._state.warmer + kelvin)
        self._conductivity = None

    def conductivity(self) -> FloatArray:
        """(n_cells,) S now, or (n_cells, 2, 2) where directions differ."""
        self.advance(0.0)
        if self._conductivity is None:
            raise AssertionError("advance makes it")
        return self._conductivity

    def resistance(self) -> FloatArray:
        """(n_electrodes, n_electrodes) Ω now.

        The same array as before unless the conductivity has changed.
        """
        sigma = self.conductivity()
        if sigma is self._solved_for:
            return self._resistance
        under = (self._presses, self._pose)
        if not _same(under, self._solved_under) or _changed(self._solved_for, sigma):
            self._resistance = _resistance_of(self._base, self._terminals, sigma)
            self.solves += 1
            self._solved_for, self._solved_under = sigma, under
        return self._resistance


def _resistance_of(rest: State, terminals: Terminals, sigma: FloatArray) -> FloatArray:
    """Exact either way: by the local update where few cells have changed since ``rest``."""
    if sigma.ndim == 1:
        changed = sigma != rest.conductivity
        if 0 < np.count_nonzero(changed) <= _FEW * len(sigma):
            cells = np.flatnonzero(changed)
            return rest.local.transfer_resistance(cells, sigma[cells])
    return np.asarray(terminals.transfer_resistance(sigma))


def _changed(old: FloatArray, new: FloatArray) -> bool:
    """Whether conductivities differ anywhere; a few cells are asked first, as most have moved."""
    if old.shape != new.shape:
        return True
    for part in (slice(None, None, _FIRST), slice(None)):
        if np.abs(new[part] - old[part]).max() > _SAME * np.abs(new[part]).min():
            return True
    return False


def _same(some: tuple[object, ...], others: tuple[object, ...]) -> bool:
    return all(a is b for a, b in zip(some, others, strict=True))
