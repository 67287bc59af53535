"""Electrode health from frame to frame: evidence → a state that lasts, with its reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.signal.evidence import (
    EqualReadings,
    Groups,
    Reciprocity,
    sign_limit,
    unchanged,
)
from tomoskin.sensing.signal.health import ElectrodeHealth, Health, Mask, Roles
from tomoskin.sensing.signal.reference import Reference

ENTER = 2
"""Frames in a row that must blame an electrode before it is called sick."""

LEAVE = 20
"""Frames in a row that must clear it before it is used again."""

_EVERY, _WINDOW = 3, 8
"""Reciprocity is looked at every so many frames, and averaged over so many looks. The mean over an
electrode's 26 pairs then has a deviation of √(2/26/15) = 0.07 of the noise's variance."""

_LOUD = 3.0
"""Variance beyond the noise's, in units of it, at which an electrode is sick: its deviation is
twice the usual one. 40 deviations of the average, so the rate of false alarms is that of other
causes; and four times the median electrode's, so that what all have in common blames none."""

_STEADY = 0.5
"""Part of an excess that comes from the mean of the errors, above which it is inconsistent
rather than noisy."""

_BIASED = 9.0
"""The same for an error that stands still: three times the noise. Channels differ by that much
where the noise is low, and less harms an image no more than noise."""

_FROZEN = 1e-9
"""Chance under which samples that do not change are called stuck, given how many others do."""

_FLOATING = ("open", "railed", "stuck")
"""States in which a reading is an unknown number, the same for all rows of its drive."""

_ALIKE = 16
"""Looks between two at whether electrodes read the same."""

_OFFSET = 170
"""Looks over which the reciprocity error at rest is followed."""


class Monitor:
    """Watches the electrodes of one skin after a reference.

    Parameters
    ----------
    pattern
        The rows.
    reference
        What the untouched skin reads, and its noise.
    model
        (n_meas,) V that the skin's model expects.
    unusable
        (n_meas,) bool: rows without a reference; they stay lost.
    scan
        The samples that rows are made of; without it samples are not looked at.
    rank
        (n_electrodes,) rank of each electrode along the rim; None for their order.
    most_own
        V that an electrode may show whatever the current does, before it is called offset.
    """

    def __init__(
        self,
        pattern: Pattern,
        reference: Reference,
        model: FloatArray,
        *,
        unusable: Mask,
        scan: Scan | None = None,
        rank: IntArray | None = None,
        most_own: float = np.inf,
    ) -> None:
        n = pattern.n_electrodes
        self._roles = Roles.of(pattern)
        noise = _noise_of(reference, model)
        self._unusable = unusable | _silent(pattern, reference.mean, noise, model, unusable)
        usable = ~self._unusable
        self._groups = Groups.of(pattern, reference.mean, noise, usable)
        self._pattern = pattern
        order = np.arange(n) if rank is None else rank
        self._sign, limit = sign_limit(pattern, reference.mean, noise, order)
        self._least = np.where(usable, -limit, -np.inf)
        self._start, self._silent = reference.mean, self._unusable
        self._reciprocity = Reciprocity.of(pattern)
        self._deviation = self._reciprocity.deviation(noise)
        self._rest = self._reciprocity.error(reference.mean)
        usable_pairs = usable[self._reciprocity.first] & usable[self._reciprocity.second]
        self._paired = usable_pairs & np.isfinite(self._deviation)
        self._squared = np.ones(len(self._rest))
        self._shift = np.zeros(len(self._rest))
        self._members = _averages(scan, n)
        self._equal = None if scan is None else EqualReadings.of(scan, n)
        self._unreached: dict[int, ElectrodeHealth] = {}
        self._pairs_left = bool(self._paired.any())
        self._looks, self._wavers = 0, dict[int, ElectrodeHealth]()
        self._still = np.zeros(n)
        self._last: FloatArray | None = None
        self._last_samples: NDArray[np.uint16] | None = None
        self._most_own = most_own
        self._blamed, self._cleared = np.zeros(n, int), np.zeros(n, int)
        self._good = tuple(ElectrodeHealth(e) for e in range(n))
        self._sick: dict[int, ElectrodeHealth] = {}
        self._well = Health(self._good, self._unusable, np.zeros(n, bool))
        self._explained_key: tuple[bytes, bytes] | None = None
        self._explained: dict[int, ElectrodeHealth] = {}
        self._masked_for: object = None
        self._masks = (self._unusable, np.zeros(n, bool))

    def push(
        self,
        values: FloatArray,
        railed: Mask,
        time: float,
        samples: NDArray[np.uint16] | None = None,
        own: FloatArray | None = None,
    ) -> Health:
        """Health of the frame with ``values`` (n_meas,) V, ``railed`` rows and ``samples``.

        ``own`` (n_electrodes,) V that does not turn with the current, where the drive alternates.
        """
        off = railed | self._unusable
        bad = off | (self._sign * values < self._least)
        dead = self._groups.dead(values, off)
        loud = self._loud(values, off)
        stuck = self._stuck(samples)
        offset = self._offset(own)
        if samples is not None and self._equal is not None and self._looks % _ALIKE == 1:
            self._unreached = self._equal(samples, values, self._reciprocity)
        seen = self._sick or self._unreached or offset or loud or stuck
        if not (seen or bad.any() or dead.any()):
            self._blamed[:] = 0
            self._silent = self._unusable
            return self._well
        return self._judged(bad, railed, dead, offset | loud | stuck, time)

    def _judged(
        self, bad: Mask, railed: Mask, dead: Mask, more: dict[int, ElectrodeHealth], time: float
    ) -> Health:
        self._silent = dead[: self._groups.n_drives][self._pattern.drive_index]
        bad |= self._silent
        key = (bad.tobytes(), dead.tobytes())
        if key != self._explained_key:
            self._explained_key, self._explained = key, self._explain(bad, railed, dead)
        driven = {  # two that touch each other make the drive between them silent
            electrode: health
            for electrode, health in self._unreached.items()
            if not self._silent[self._roles.drives[electrode]].any()
        }
        causes = more | self._explained | driven
        self._debounce(causes, time)
        blamed = (causes | self._sick).items()
        states = {e: h.state for e, h in blamed if h.state != "offset"}
        if (key, states) != self._masked_for:
            self._masked_for = (key, states)
            self._masks = _masks(self._pattern, self._roles, bad, states, self._unusable)
        electrodes = tuple(self._sick.get(e, good) for e, good in enumerate(self._good))
        return Health(electrodes, *self._masks)

    def _explain(self, bad: Mask, railed: Mask, dead: Mask) -> dict[int, ElectrodeHealth]:
        """Electrodes that explain what is not as it should be in rows, drives and pairs."""
        groups, causes = self._groups, {}
        for electrode, state in self._roles.blamed(bad).items():
            reason = self._reason(electrode, state, railed)
            causes[electrode] = ElectrodeHealth(electrode, state, reason)
        for a, b in groups.pairs[dead[groups.n_drives :]].tolist():
            if not any(e in causes and causes[e].state == "open" for e in (a, b)):
                causes[a] = ElectrodeHealth(a, "short", _short_text(b))
                causes[b] = ElectrodeHealth(b, "short", _short_text(a))
        return causes

    def _debounce(self, causes: dict[int, ElectrodeHealth], time: float) -> None:
        for e in range(len(self._good)):
            here = e in causes
            self._blamed[e] = self._blamed[e] + 1 if here else 0
            self._cleared[e] = 0 if here else self._cleared[e] + 1
            if here and self._blamed[e] >= ENTER:
                now, before = causes[e], self._sick.get(e)
                if before is None or before.state != now.state:
                    self._sick[e] = replace(now, since=time)
            elif e in self._sick and self._cleared[e] >= LEAVE:
                del self._sick[e]

    def _reason(self, electrode: int, state: str, railed: Mask) -> str:
        reads, drives = self._roles.reads[electrode], self._roles.drives[electrode]
        at_rail = f"{int((reads & railed).sum())} of {int(reads.sum())} readings are at a rail"
        if state == "railed":
            return at_rail
        return f"no current in any of its {int(drives.sum())} driven rows, and {at_rail}"

    def _loud(self, values: FloatArray, off: Mask) -> dict[int, ElectrodeHealth]:
        """Electrodes whose reciprocity wavers by more than the noise."""
        self._looks += 1
        if self._looks % _EVERY or not self._pairs_left:
            return self._wavers
        last, self._last = self._last, values
        if last is None:
            return {}
        pairs = self._reciprocity
        error = pairs.error(values) - self._rest
        squared = pairs.squared(error, self._deviation, values - last, values - self._start)
        use = self._paired
        if self._silent.any() or off.any():
            off = off | self._silent
            use = use & ~(off[pairs.first] | off[pairs.second])
        np.copyto(squared, self._squared, where=~use)
        np.copyto(error, 0.0, where=~use)
        self._squared += (squared - self._squared) / _WINDOW
        self._shift += (error / self._deviation - self._shift) / _WINDOW
        self._rest += np.clip(error, -self._deviation, self._deviation) / _OFFSET
        if (pairs.mean @ self._squared).max() < 1.0 + _LOUD / 2:
            self._wavers = {}
            return {}
        excess = pairs.excess(self._squared)
        limit = max(_LOUD, 4.0 * float(np.median(excess)))
        loud = [(e, float(excess[e])) for e in np.flatnonzero(excess > limit).tolist()]
        self._wavers = {e: h for e, much in loud if (h := self._wavering(e, much))}
        return self._wavers

    def _wavering(self, electrode: int, excess: float) -> ElectrodeHealth | None:
        steady = float(self._reciprocity.mean[electrode] @ np.minimum(self._shift**2, 25.0))
        times = f"{np.sqrt(1 + excess):.1f} times the noise"
        if steady <= _STEADY * excess:
            return ElectrodeHealth(
                electrode, "noisy", f"its reciprocity error fluctuates by {times} at rest"
            )
        if excess <= _BIASED:
            return None
        return ElectrodeHealth(
            electrode, "inconsistent", f"its reciprocity error is {times} at rest"
        )

    def _offset(self, own: FloatArray | None) -> dict[int, ElectrodeHealth]:
        """Electrodes with a voltage of their own that takes up much of the converter's range."""
        if own is None:
            return {}
        away = own - np.median(own)
        return {
            e: ElectrodeHealth(
                e,
                "offset",
                f"it shows {1e3 * away[e]:+.1f} mV whatever the current does: its contact "
                "polarises or has another temperature; the alternating drive takes that out",
            )
            for e in np.flatnonzero(np.abs(away) > self._most_own).tolist()
        }

    def _stuck(self, samples: NDArray[np.uint16] | None) -> dict[int, ElectrodeHealth]:
        """Electrodes whose samples stand still while the others' go on."""
        last, self._last_samples = self._last_samples, samples
        if samples is None or last is None or self._members is None:
            return {}
        share = unchanged(samples, last, self._members)
        alone = share[:-1] > 1.0 - 1e-9
        if share[-1] > 0.5 or not alone.any():
            self._still[:] = 0.0
            return {}
        self._still = np.where(alone, self._still + 1, 0.0)
        count = 1.0 / np.maximum(self._members[:-1].max(axis=1), 1e-9)
        chance = np.log(max(share[-1], 0.05)) * count * self._still
        return {
            e: ElectrodeHealth(e, "stuck", f"its {round(count[e])} samples do not change")
            for e in np.flatnonzero(chance < np.log(_FROZEN)).tolist()
        }


def _masks(
    pattern: Pattern, roles: Roles, bad: Mask, states: Mapping[int, str], unusable: Mask
) -> tuple[Mask, Mask]:
    """Rows that are lost, and electrodes whose reading is an unknown number that rows share."""
    floating = np.zeros(pattern.n_electrodes, bool)
    taken = unusable.copy()
    for electrode, state in states.items():
        if state in _FLOATING:
            floating[electrode] = True
        if state not in ("railed", "stuck"):
            taken |= roles.drives[electrode]
        if state not in _FLOATING:
            taken |= roles.reads[electrode]
    shared = floating[pattern.measure].any(axis=1)
    lost = taken | (bad & ~shared)
    # a reading beside a floating one that looks bad in its other row too is bad itself
    suspect = np.zeros((pattern.n_drive, pattern.n_electrodes), bool)
    for end in pattern.measure[bad & ~shared].T:
        suspect[pattern.drive_index[bad & ~shared], end] = True
    lost |= shared & suspect[pattern.drive_index[:, None], pattern.measure].any(axis=1)
    return lost, floating


def _short_text(other: int) -> str:
    return f"it reads the same as E{other + 1} under every drive; take a new reference"


def _noise_of(reference: Reference, model: FloatArray) -> FloatArray:
    """(n_meas,) V of noise, above zero; infinite where it is unknown, which blames no electrode."""
    if not (reference.noise_is_known and reference.noise.all()):
        return np.full(len(model), np.inf)
    return np.maximum(reference.noise, 1e-6 * float(np.sqrt(np.mean(model**2))))


def _silent(
    pattern: Pattern, rest: FloatArray, noise: FloatArray, model: FloatArray, unusable: Mask
) -> Mask:
    """(n_meas,) rows of drives that carried no current while the reference was taken."""
    usable = ~unusable & (model != 0)
    if not usable.any():
        return np.zeros(len(model), bool)
    scale = float(np.median(np.abs(rest[usable] / model[usable])))
    groups = Groups.of(pattern, scale * model, noise, usable)
    dead = groups.dead(rest, unusable)[: groups.n_drives]
    return np.asarray(dead[pattern.drive_index])


def _averages(scan: Scan | None, n: int) -> FloatArray | None:
    if scan is None:
        return None
    each = (scan.sample_electrode == np.arange(n)[:, None]).astype(float)
    rows = np.concatenate([each, np.ones((1, scan.n_samples))])
    return np.asarray(rows / np.maximum(rows.sum(axis=1), 1.0)[:, None])
