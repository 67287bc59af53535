"""A mapping: at which electrode each wire ends, and which way round voltages are read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.skin import Skin

_MICRON = 1e6


@dataclass(frozen=True)
class ChannelMapping:
    """How the wires of a board or recording meet the electrodes that a skin file describes.

    Attributes
    ----------
    electrodes
        For each wire, the electrode of the skin file that it is really at; 0, 1, 2, … when all is
        as the file says.
    reversed
        Whether voltages come with the opposite sign.
    """

    electrodes: tuple[int, ...]
    reversed: bool = False

    @classmethod
    def as_drawn(cls, n: int) -> Self:
        """The mapping that the skin file draws: channel i at electrode i."""
        return cls(tuple(range(n)))

    def turned(self, ring: tuple[int, ...], steps: int, *, mirrored: bool) -> Self:
        """Turned by a number of electrodes along ``ring``, their order along the rim."""
        n, rank = len(ring), {electrode: k for k, electrode in enumerate(ring)}
        way = -1 if mirrored else 1
        electrodes = tuple(ring[(steps + way * rank[p]) % n] for p in self.electrodes)
        return replace(self, electrodes=electrodes)

    def swapped(self, a: int, b: int) -> Self:
        """With the wires ``a`` and ``b`` exchanged."""
        electrodes = list(self.electrodes)
        electrodes[a], electrodes[b] = electrodes[b], electrodes[a]
        return replace(self, electrodes=tuple(electrodes))

    def applied(self, skin: Skin) -> Skin:
        """Skin whose electrodes are named by the wires that end at them."""
        where = skin.electrode_centres[list(self.electrodes)]
        impedance = skin.document["electrodes"]["contact_impedance"]
        if isinstance(impedance, list):
            impedance = [impedance[place] for place in self.electrodes]
        evenly: dict[str, object] = dict.fromkeys(("count", "first", "order"))
        electrodes = evenly | {"positions": _written(where), "contact_impedance": impedance}
        was = skin.polarity < 0
        drive = {"polarity": "reversed" if was != self.reversed else None}
        return skin.altered({"electrodes": electrodes, "drive": drive})

    def text(self, ring: tuple[int, ...]) -> str:
        """In words: what differs from the skin file."""
        plain = ChannelMapping.as_drawn(len(ring))
        turns = [
            (sum(a != b for a, b in zip(self.electrodes, base.electrodes, strict=True)), m, k, base)
            for m in (False, True)
            for k in range(len(ring))
            for base in [plain.turned(ring, k, mirrored=m)]
        ]
        _, mirrored, steps, base = min(turns, key=lambda turn: turn[:3])
        said = []
        if mirrored:
            said.append("mirrored")
        if steps:
            said.append(f"turned by {steps} electrode{'s' if steps > 1 else ''}")
        odd = [k for k, place in enumerate(self.electrodes) if place != base.electrodes[k]]
        said += [f"E{k + 1} at the position of E{self.electrodes[k] + 1}" for k in odd]
        if self.reversed:
            said.append("polarity reversed")
        return ", ".join(said) or "as the skin file says"


def ring_of(skin: Skin) -> tuple[int, ...]:
    """Electrodes in their order along the rim, as near to 0, 1, 2, … as it goes."""
    along = np.argsort([arc.start for arc in skin.arcs])
    order = np.roll(along, -int(np.argmin(along)))
    if len(order) > 2 and order[-1] < order[1]:
        order = np.roll(order[::-1], 1)
    return tuple(order.tolist())


def turns(ring: tuple[int, ...]) -> Iterator[ChannelMapping]:
    """Every rotation and mirroring."""
    plain = ChannelMapping.as_drawn(len(ring))
    for mirrored in (False, True):
        for steps in range(len(ring)):
            yield plain.turned(ring, steps, mirrored=mirrored)


def swaps(mapping: ChannelMapping) -> Iterator[ChannelMapping]:
    """Every mapping in which two wires are exchanged."""
    for a, b in combinations(range(len(mapping.electrodes)), 2):
        yield mapping.swapped(a, b)


def _written(where: FloatArray) -> list[list[str]]:
    return [[f"{round(_MICRON * v) / 1e3:g} mm" for v in point] for point in where]
