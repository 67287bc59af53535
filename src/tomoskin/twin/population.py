"""What labelled frames are drawn from: numbers, positions, sizes and forces of presses."""

from __future__ import annotations

from typing import Self

import numpy as np

from tomoskin.core import FloatArray, ScriptError
from tomoskin.model.mesh import Outline
from tomoskin.twin.probe import Probe
from tomoskin.twin.script import of_script, tables_of
from tomoskin.twin.script_schema import PressesSection
from tomoskin.twin.shape import FACES

_STEP = 0.5e-3
"""Half extents are rounded to this, m: the dent of a face is solved once and used again."""

_TRIES = 2000
"""Places drawn for one probe before there is taken to be no room for it."""


class Population(PressesSection):
    """Ranges that presses are drawn from, evenly and independently: a script's ``[presses]``.

    Half extents ``size`` and ``margin`` and ``apart`` are in m, ``force`` in N, ``hold`` in s.
    """

    @classmethod
    def from_toml(cls, text: str, *, source: str = "script") -> Self:
        """Population of a script's section ``[presses]``.

        Raises
        ------
        ScriptError
            For an unknown or missing key, or a value that cannot be meant.
        """
        with of_script():
            tables = tables_of(text, source)
            others = [name for name in tables if name != cls.section]
            if others or cls.section not in tables:
                raise ScriptError(
                    f"expected only the section [presses], got {', '.join(tables) or 'none'}",
                    where=f"{source}: [{others[0]}]" if others else source,
                    hint="labelled frames have no timeline: leave --presses out to run one",
                )
            return cls.read(tables[cls.section], f"{source}: {cls.heading}")

    def draw(self, outline: Outline, random: np.random.Generator) -> tuple[Probe, ...]:
        """Presses of one frame on a sheet of that ``outline``.

        Raises
        ------
        ScriptError
            When there is no room for as many, so far from each other and the rim.
        """
        number = int(random.integers(self.count[0], self.count[1] + 1))
        positions = np.empty((0, 2))
        for _ in range(number):
            positions = np.vstack([positions, self._place(outline, positions, random)])
        return tuple(self._probe(position, random) for position in positions)

    def _place(
        self, outline: Outline, others: FloatArray, random: np.random.Generator
    ) -> FloatArray:
        corners = outline.polyline(outline.length / 64)
        low, high = corners.min(axis=0), corners.max(axis=0)
        for _ in range(_TRIES):
            position = np.asarray(random.uniform(low, high))
            if self._has_room(outline, position, others):
                return position
        raise ScriptError(
            f"found no position {1e3 * self.margin:g} mm from the rim and "
            f"{1e3 * self.apart:g} mm from {len(others)} other probes",
            where="[presses] margin, apart",
            hint="use fewer presses, or smaller distances",
        )

    def _has_room(self, outline: Outline, position: FloatArray, others: FloatArray) -> bool:
        if len(others) and np.hypot(*(others - position).T).min() < self.apart:
            return False
        if not outline.contains(position[None])[0]:
            return False
        rim = outline.point(outline.nearest(position[None]))[0]
        return bool(np.hypot(*(rim - position)) >= self.margin)

    def _probe(self, position: FloatArray, random: np.random.Generator) -> Probe:
        shape = self.shapes[random.integers(len(self.shapes))]
        size = _STEP * round(random.uniform(*self.size) / _STEP)
        force, angle = random.uniform(*self.force), random.uniform(0, 2 * np.pi)
        face = FACES[shape](max(size, _STEP))
        return Probe(face, float(position[0]), float(position[1]), float(force), float(angle))


COMMON_PRESSES = Population(
    count=(1, 1),
    shapes=("circle",),
    size=(8e-3, 20e-3),
    force=(1.0, 8.0),
    hold=1.0,
    margin=5e-3,
    apart=40e-3,
)
"""What is drawn from where nothing is said: one round probe of a finger's to a palm's size."""
