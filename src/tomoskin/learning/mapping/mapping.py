"""A mapping: at which electrode each wire ends, which way round voltages are read; and how well it
explains labelled presses: the forward model's answers against the data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Self

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import Spots, spots_of

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
        written = [[f"{round(_MICRON * v) / 1e3:g} mm" for v in point] for point in where]
        electrodes = evenly | {"positions": written, "contact_impedance": impedance}
        was = skin.polarity < 0
        drive = {"polarity": "reversed" if was != self.reversed else None}
        return skin.altered({"electrodes": electrodes, "drive": drive})

    def text(self, ring: tuple[int, ...]) -> str:
        """In words: what differs from the skin file."""
        bases = np.array([base.electrodes for base in turns(ring)])
        nearest = int((bases != self.electrodes).sum(axis=1).argmin())
        mirrored, steps = divmod(nearest, len(ring))
        said = []
        if mirrored:
            said.append("mirrored")
        if steps:
            said.append(f"turned by {steps} electrode{'s' if steps > 1 else ''}")
        odd = np.flatnonzero(bases[nearest] != self.electrodes).tolist()
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


_RADII = (0.04, 0.1)
"""Of a press, in parts of the sheet's extent: which it is, is not known."""

_DEPTH = 0.25
"""Part of the conductivity that a press takes; its strength is fitted, the shape depends little."""

_QUIET = 0.02
"""Noise where it was not measured, in parts of the data's median."""

_BLOCK = 64


@dataclass(frozen=True, eq=False)
class IndentationResponses:
    """What presses at some positions do to the transfer resistances of a skin.

    ``positions`` (p, 2) m; ``changes`` (size, p, n, n) Ω of a press of each size; ``rest`` (n, n)
    Ω.
    """

    model: ForwardModel
    positions: FloatArray
    changes: FloatArray
    rest: FloatArray

    @classmethod
    def of(cls, skin: Skin, positions: FloatArray) -> Self:
        """By the exact local update, for presses that lower the conductivity."""
        mesh = skin.mesh()
        model = ForwardModel(
            mesh, skin.pattern(), skin.contact_impedance, skin.polarity * skin.current
        )
        state = model.at(skin.conductivity)
        extent = float(np.ptp(mesh.points, axis=0).max())
        shapes = Spots(mesh)
        sizes = []
        for radius in _RADII:
            spots = spots_of(positions, radius * extent, np.log1p(-_DEPTH))
            touches = []
            for spot in spots:
                cells, change = shapes.change(spot[None])
                touches.append((cells, skin.conductivity * np.exp(change)))
            changed = state.local.transfer_resistances_of(touches)
            sizes.append(changed - state.transfer_resistance)
        return cls(model, positions, np.stack(sizes), np.asarray(state.transfer_resistance))

    def rows(self, mappings: Sequence[ChannelMapping], resistance: FloatArray) -> FloatArray:
        """(h, …, n_meas) V of resistances (…, n, n) Ω as each mapping reads them, sign apart."""
        order = np.array([w.electrodes for w in mappings])
        response = [resistance[..., p[:, None], p] for p in order]
        return np.asarray(self.model.voltages(np.stack(response)))


@dataclass(frozen=True, eq=False)
class MappingLikelihood:
    """Labelled presses, and what they say of a mapping.

    Rows are compared in units of the noise, and by the root of their size: so rows that shout do
    not drown the others, and how strong a press was drops out. Signs and sizes of a press's rows
    count, and beside these how loud each row is in one press against the others: on sheets that
    are uneven, that alone is right.

    Attributes
    ----------
    sheet
        Responses at the labels.
    dv
        (p, n_meas) V, in the rows of the skin's pattern.
    noise
        (n_meas,) V.
    reference
        (n_meas,) V of the untouched skin, or None where it is not known.
    signs
        What presses do to the conductivity: 1 lower it, −1 raise it, both where it is not known.
    worth
        Independent readings that a press is worth.
    """

    sheet: IndentationResponses
    dv: FloatArray
    noise: FloatArray
    reference: FloatArray | None
    signs: tuple[float, ...]
    worth: float

    def presses(self, mappings: Sequence[ChannelMapping]) -> FloatArray:
        """(h, sign, size, p) log-likelihood of each press under each mapping; 0: says nothing."""
        parts = [
            self._presses(mappings[start : start + _BLOCK])
            for start in range(0, len(mappings), _BLOCK)
        ]
        return np.concatenate(parts)

    def _presses(self, mappings: Sequence[ChannelMapping]) -> FloatArray:
        predicted = self.sheet.rows(mappings, self.sheet.changes)
        correlation = agreement(self.dv, predicted, self.noise)
        way = np.array([-1.0 if w.reversed else 1.0 for w in mappings])
        signed = (
            correlation[:, None] * np.array(self.signs)[:, None, None] * way[:, None, None, None]
        )
        loud = likelihood(loudness(self.dv, predicted, self.noise), self.worth)
        return np.asarray(likelihood(signed, self.worth) + loud[:, None])

    def at_rest(self, mappings: Sequence[ChannelMapping]) -> FloatArray:
        """(h,) log-likelihood of the untouched skin's voltages; 0 where they are not known."""
        if self.reference is None:
            return np.zeros(len(mappings))
        noise = np.full(len(self.reference), _QUIET * np.median(np.abs(self.reference)))
        predicted = self.sheet.rows(mappings, self.sheet.rest)
        correlation = agreement(self.reference, predicted, noise)
        return likelihood(correlation * [-1.0 if w.reversed else 1.0 for w in mappings], self.worth)

    def __call__(self, mappings: Sequence[ChannelMapping]) -> FloatArray:
        """(h,) log-likelihood of all; the unknown size and sign are averaged over."""
        each = self.presses(mappings).sum(axis=-1)
        most = each.max(axis=(1, 2))
        mean = np.exp(each - most[:, None, None]).mean(axis=(1, 2))
        return np.asarray(most + np.log(mean) + self.at_rest(mappings))


def agreement(measured: FloatArray, predicted: FloatArray, noise: FloatArray) -> FloatArray:
    """(…,) cosine between measured (…, n_meas) and predicted changes of unknown strength."""
    finite = np.isfinite(measured)
    response = np.where(finite, measured, 0.0) / noise
    predicted = np.where(finite, predicted, 0.0) / noise
    size = np.linalg.norm(response, axis=-1) / np.maximum(
        np.linalg.norm(predicted, axis=-1), 1e-300
    )
    a, b = _rooted(response), _rooted(predicted * size[..., None])
    product = (a * b).sum(axis=-1)
    lengths = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    return np.asarray(product / np.maximum(lengths, 1e-300))


def loudness(measured: FloatArray, predicted: FloatArray, noise: FloatArray) -> FloatArray:
    """(…, p) correlation over the rows of how loud each is in a press, against other presses.

    Measured (p, n_meas), predicted (…, p, n_meas). Each row is divided by its mean over the
    presses, so that neither gains nor uneven sheets matter; 0 for a single press.
    """
    finite = np.isfinite(measured)
    a = _loud(np.where(finite, measured, 0.0) / noise)
    b = _loud(np.where(finite, predicted, 0.0) / noise)
    product, lengths = (a * b).sum(axis=-1), np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    return np.asarray(product / np.maximum(lengths, 1e-9 * a.shape[-1]))


def _loud(rows: FloatArray) -> FloatArray:
    size = np.abs(_rooted(rows))
    size = size / np.maximum(np.sqrt((size**2).mean(axis=-2, keepdims=True)), 1e-9)
    return np.asarray(size - size.mean(axis=-1, keepdims=True))


def likelihood(cosine: FloatArray | float, worth: float) -> FloatArray:
    """−(m/2) log(1 − ρ²): of a signal of unknown strength in noise of unknown size.

    ``worth`` is the number m of independent readings. A signal of the wrong sign says nothing.
    """
    return np.asarray(-0.5 * worth * np.log1p(-(np.clip(cosine, 0.0, 0.999) ** 2)))


def quiet_noise(dv: FloatArray) -> FloatArray:
    """(n_meas,) noise where none was measured: a small part of the data's median."""
    size = np.abs(dv[np.isfinite(dv)])
    return np.full(dv.shape[1], max(_QUIET * float(np.median(size[size > 0])), 1e-300))


def _rooted(rows: FloatArray) -> FloatArray:
    """Linear up to the noise, then as the root."""
    return np.asarray(rows / (1.0 + rows**2) ** 0.25)
