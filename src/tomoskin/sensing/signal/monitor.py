"""Electrode health from frame to frame: evidence → a state that lasts, with its reason."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.sensing.signal.baseline import Reference
from tomoskin.sensing.signal.evidence import EqualReadings, Groups, Reciprocity, sign_limit
from tomoskin.sensing.signal.health import ElectrodeHealth, Health, Mask, Roles

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


class ReciprocityWatch:
    """Looks for electrodes whose reciprocity wavers by more than the noise.

    Parameters
    ----------
    pairs
        Rows that exchange driven and measuring pair.
    start, noise
        (n_meas,) V that the untouched skin reads, and its noise.
    usable
        (n_meas,) bool.
    """

    def __init__(
        self, pairs: Reciprocity, start: FloatArray, noise: FloatArray, usable: Mask
    ) -> None:
        self._pairs, self._start, self._deviation = pairs, start, pairs.deviation(noise)
        self._rest = pairs.error(start)
        self._used = usable[pairs.first] & usable[pairs.second] & np.isfinite(self._deviation)
        self._squared, self._shift = np.ones(len(self._rest)), np.zeros(len(self._rest))
        self._last: FloatArray | None = None
        self._causes: dict[int, ElectrodeHealth] = {}
        self.looks = 0

    def push(self, values: FloatArray, off: Mask) -> dict[int, ElectrodeHealth]:
        """Those of a frame, (n_meas,) V without the rows that are ``off``."""
        self.looks += 1
        if self.looks % _EVERY or not self._used.any():
            return self._causes
        last, self._last = self._last, values
        if last is None:
            return {}
        self._average(values, last, off)
        self._causes = {}
        if (self._pairs.mean @ self._squared).max() >= 1.0 + _LOUD / 2:
            excess = self._pairs.excess(self._squared)
            limit = max(_LOUD, 4.0 * float(np.median(excess)))
            for e in np.flatnonzero(excess > limit).tolist():
                self._blame(e, float(excess[e]))
        return self._causes

    def _average(self, values: FloatArray, last: FloatArray, off: Mask) -> None:
        pairs, use = self._pairs, self._used
        error = pairs.error(values) - self._rest
        squared = pairs.squared(error, self._deviation, values - last, values - self._start)
        if off.any():
            use = use & ~(off[pairs.first] | off[pairs.second])
        np.copyto(squared, self._squared, where=~use)
        np.copyto(error, 0.0, where=~use)
        self._squared += (squared - self._squared) / _WINDOW
        self._shift += (error / self._deviation - self._shift) / _WINDOW
        self._rest += np.clip(error, -self._deviation, self._deviation) / _OFFSET

    def _blame(self, electrode: int, excess: float) -> None:
        steady = float(self._pairs.mean[electrode] @ np.minimum(self._shift**2, 25.0))
        times = f"{np.sqrt(1 + excess):.1f} times the noise at rest"
        state, reason = "noisy", f"its reciprocity error fluctuates by {times}"
        if steady > _STEADY * excess:
            if excess <= _BIASED:
                return
            state, reason = "inconsistent", f"its reciprocity error is {times}"
        self._causes[electrode] = ElectrodeHealth(electrode, state, reason)


class SampleWatch:
    """Looks for electrodes whose samples stand still while the others' go on.

    Parameters
    ----------
    scan
        The samples of ``n`` electrodes.
    """

    def __init__(self, scan: Scan, n: int) -> None:
        each = (scan.sample_electrode == np.arange(n)[:, None]).astype(float)
        rows = np.concatenate([each, np.ones((1, scan.n_samples))])
        # averages over each electrode's samples; the last, over all
        self._members = rows / np.maximum(rows.sum(axis=1), 1.0)[:, None]
        self._still = np.zeros(n)
        self._last: NDArray[np.uint16] | None = None

    def push(self, samples: NDArray[np.uint16] | None) -> dict[int, ElectrodeHealth]:
        """Those of a frame, (n_samples,) counts."""
        last, self._last = self._last, samples
        if samples is None or last is None:
            return {}
        share = np.asarray(self._members @ (samples == last).astype(float))
        alone = share[:-1] > 1.0 - 1e-9
        if share[-1] > 0.5 or not np.count_nonzero(alone):
            self._still[:] = 0.0
            return {}
        self._still = np.where(alone, self._still + 1, 0.0)
        count = 1.0 / np.maximum(self._members[:-1].max(axis=1), 1e-9)
        chance = np.log(max(share[-1], 0.05)) * count * self._still
        return {
            e: ElectrodeHealth(e, "stuck", f"its {round(count[e])} samples do not change")
            for e in np.flatnonzero(chance < np.log(_FROZEN)).tolist()
        }


class Debounce:
    """What electrodes are blamed for in frames → states that last; ``sick`` are those that are not
    good."""

    def __init__(self, n: int) -> None:
        self.sick: dict[int, ElectrodeHealth] = {}
        self._blamed, self._cleared = np.zeros(n, int), np.zeros(n, int)

    def push(self, causes: dict[int, ElectrodeHealth], time: float) -> None:
        """Take the ``causes`` of a frame at ``time`` s."""
        for e in range(len(self._blamed)):
            here = e in causes
            self._blamed[e] = self._blamed[e] + 1 if here else 0
            self._cleared[e] = 0 if here else self._cleared[e] + 1
            if here and self._blamed[e] >= ENTER:
                now, before = causes[e], self.sick.get(e)
                if before is None or before.state != now.state:
                    self.sick[e] = replace(now, since=time)
            elif e in self.sick and self._cleared[e] >= LEAVE:
                del self.sick[e]

    def rest(self) -> None:
        """Take a frame in which nobody is blamed, and nobody was."""
        self._blamed[:] = 0


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
        n, rest = pattern.n_electrodes, reference.mean
        noise = _noise_of(reference, model)
        self._pattern, self._roles, self._most_own = pattern, Roles.of(pattern), most_own
        self._unusable = self._silent = unusable | _silent(pattern, rest, noise, model, unusable)
        usable = ~self._unusable
        self._groups = Groups.of(pattern, rest, noise, usable)
        order = np.arange(n) if rank is None else rank
        self._sign, limit = sign_limit(pattern, rest, noise, order)
        self._least = np.where(usable, -limit, -np.inf)
        self._pairs = Reciprocity.of(pattern)
        self._reciprocity = ReciprocityWatch(self._pairs, rest, noise, usable)
        self._samples = None if scan is None else SampleWatch(scan, n)
        self._equal = None if scan is None else EqualReadings.of(scan, n)
        self._unreached: dict[int, ElectrodeHealth] = {}
        self._states = Debounce(n)
        self._good = tuple(ElectrodeHealth(e) for e in range(n))
        self._well = Health(self._good, self._unusable, np.zeros(n, bool))
        # what was concluded of the last frame: as a rule the next one is like it
        self._explained: tuple[object, dict[int, ElectrodeHealth]] = None, {}
        self._masks: tuple[object, tuple[Mask, Mask]] = None, (self._unusable, np.zeros(n, bool))

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
        causes = dict(self._reciprocity.push(values, off | self._silent))
        if own is not None:
            causes = self._offset(own) | causes
        if self._samples is not None:
            causes |= self._samples.push(samples)
        if samples is not None and self._equal and self._reciprocity.looks % _ALIKE == 1:
            self._unreached = self._equal(samples, values, self._pairs)
        blamed = self._states.sick or self._unreached or causes
        if not (blamed or np.count_nonzero(bad) or np.count_nonzero(dead)):
            self._states.rest()
            self._silent = self._unusable
            return self._well
        return self._judged(bad, railed, dead, causes, time)

    def _judged(
        self, bad: Mask, railed: Mask, dead: Mask, causes: dict[int, ElectrodeHealth], time: float
    ) -> Health:
        self._silent = dead[: self._groups.n_drives][self._pattern.drive_index]
        bad |= self._silent
        key = (bad.tobytes(), dead.tobytes())
        if key != self._explained[0]:
            self._explained = key, self._explain(bad, railed, dead)
        driven = {  # two that touch each other make the drive between them silent
            electrode: health
            for electrode, health in self._unreached.items()
            if not self._silent[self._roles.drives[electrode]].any()
        }
        causes = causes | self._explained[1] | driven
        self._states.push(causes, time)
        sick = self._states.sick
        states = {e: h.state for e, h in (causes | sick).items() if h.state != "offset"}
        if (key, states) != self._masks[0]:
            masks = _masks(self._pattern, self._roles, bad, states, self._unusable)
            self._masks = (key, states), masks
        electrodes = tuple(sick.get(e, good) for e, good in enumerate(self._good))
        return Health(electrodes, *self._masks[1])

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

    def _reason(self, electrode: int, state: str, railed: Mask) -> str:
        reads, drives = self._roles.reads[electrode], self._roles.drives[electrode]
        at_rail = f"{int((reads & railed).sum())} of {int(reads.sum())} readings are at a rail"
        if state == "railed":
            return at_rail
        return f"no current in any of its {int(drives.sum())} driven rows, and {at_rail}"

    def _offset(self, own: FloatArray) -> dict[int, ElectrodeHealth]:
        """Electrodes with a voltage of their own that takes up much of the converter's range."""
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
