"""What one frame says against electrodes, from voltages and samples alone.

Nothing here is a touch, however strong: a press changes voltages, but leaves every drive its
current, every voltage its sign and every row equal to its reciprocal.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import RECIPROCALS, Pattern, Scan
from tomoskin.sensing.signal.health import ElectrodeHealth, Mask, Roles

SIGMAS = 6.0
"""A Gaussian value goes beyond so many deviations once in 10⁹ (one side): with 208 rows at 20
frames/s once in three days, and then in one row, which no electrode is blamed for."""

_DEAD_DRIVE, _DEAD_PAIR = 0.45, 0.05
"""A drive or a pair is dead when fewer of its rows live. A floating electrode makes two rows of a
silent drive live, of 13 or of 5; nothing that is pressed makes half of them silent."""

_FEWEST = 3
"""Rows that a group must have to be called dead."""

_LEAK = 0.03
"""Part of its voltage at rest that a dead group may still show: an amplifier's common mode."""

_MONOTONE = 2.0 * SIGMAS
"""Rows with less than so many deviations of voltage have no sign to lose."""

_GAIN = 0.03
"""Part by which channels may differ in gain: of a change, so much may stand between reciprocals."""

_MOST = 25.0
"""Squared deviations are cut off here: one wild value must not blame an electrode."""


@dataclass(frozen=True, eq=False)
class Groups:
    """Rows that live and die together: those of a drive, and those of a measuring pair.

    Attributes
    ----------
    shares
        (n_groups, n_meas): averages over the rows of a group that live at rest; drives first.
    dead_below
        (n_groups,) part of these that must live; 0 where a group cannot be judged.
    limit
        (n_meas,) V under which a row does not live: noise, or what leaks.
    n_drives, pairs
        How many groups are drives, and the (n_pairs, 2) electrodes of the others.
    """

    shares: FloatArray
    dead_below: FloatArray
    limit: FloatArray
    n_drives: int
    pairs: IntArray

    @classmethod
    def of(cls, pattern: Pattern, rest: FloatArray, noise: FloatArray, usable: Mask) -> Groups:
        """Groups of a skin that reads ``rest`` V with ``noise`` V while untouched."""
        drives = pattern.drive_index == np.arange(pattern.n_drive)[:, None]
        pairs, which = np.unique(np.sort(pattern.measure, axis=1), axis=0, return_inverse=True)
        reads = which.reshape(-1) == np.arange(len(pairs))[:, None]
        power = (drives @ rest**2) / np.maximum(drives.sum(axis=1), 1)
        limit = np.hypot(SIGMAS * noise, _LEAK * np.sqrt(power)[pattern.drive_index])
        lives = usable & (np.abs(rest) > 2.0 * limit)
        members = np.concatenate([drives, reads]) & lives
        count = members.sum(axis=1)
        dead_below = np.repeat([_DEAD_DRIVE, _DEAD_PAIR], [len(drives), len(reads)])
        dead_below[count < _FEWEST] = 0.0
        shares = members / np.maximum(count, 1)[:, None]
        return cls(shares, dead_below, limit, pattern.n_drive, pairs)

    def dead(self, values: FloatArray, railed: Mask) -> Mask:
        """(n_groups,) from (n_meas,) V; a row at a rail is not silent."""
        lives = (np.abs(values) > self.limit) | railed
        return np.asarray(self.shares @ lives.astype(float) < self.dead_below)


def sign_limit(
    pattern: Pattern, rest: FloatArray, noise: FloatArray, rank: IntArray
) -> tuple[FloatArray, FloatArray]:
    """(n_meas,) sign and limit: sign · voltage below −limit is impossible, whatever is pressed.

    Along the rim of a simply connected sheet the potential falls all the way from source to
    sink for every conductivity (maximum principle; Curtis, Ingerman & Morrow 1998, Linear
    Algebra Appl. 283, 115). Neighbours on the rim, ``rank`` (n_electrodes,), stand on one side.
    """
    n = pattern.n_electrodes
    apart = np.abs(np.diff(rank[pattern.measure], axis=1)[:, 0])
    certain = ((apart == 1) | (apart == n - 1)) & (np.abs(rest) > _MONOTONE * noise)
    return np.where(rest < 0, -1.0, 1.0), np.where(certain, SIGMAS * noise, np.inf)


@dataclass(frozen=True, eq=False)
class Reciprocity:
    """Pairs of rows that exchange the driven and the measuring pair.

    They are equal on any sheet, whatever its conductivity (Geselowitz 1971, IEEE Trans. Biomed.
    Eng. 18, 38), so what their difference wavers by comes from electrodes and channels.

    ``first``, ``second`` (k,) rows, ``sign`` (k,) of the second; ``touches`` (n_electrodes, k)
    bool, the electrodes of each.
    """

    first: IntArray
    second: IntArray
    sign: FloatArray
    touches: Mask

    @classmethod
    def of(cls, pattern: Pattern) -> Reciprocity:
        """All pairs of a pattern; there may be none."""
        rows = np.hstack([pattern.drive, pattern.measure]).tolist()
        number_of = {tuple(row): number for number, row in enumerate(rows)}
        exchanged = [
            (number, number_of.get(tuple(row[end] for end in order), -1), sign)
            for number, row in enumerate(rows)
            for order, sign in RECIPROCALS
        ]
        table = np.array([one for one in exchanged if one[1] > one[0]], float).reshape(-1, 3)
        first, second = table[:, :2].astype(np.int64).T
        roles = Roles.of(pattern)
        touches = (roles.drives | roles.reads)[:, first]
        return cls(first, second, table[:, 2], touches)

    @cached_property
    def mean(self) -> FloatArray:
        """(n_electrodes, k): averages over the pairs of each electrode."""
        count = np.maximum(self.touches.sum(axis=1), 1)
        return np.asarray(self.touches / count[:, None])

    def error(self, values: FloatArray) -> FloatArray:
        """(k,) V between each row and its reciprocal."""
        return np.asarray(values[self.first] - self.sign * values[self.second])

    def deviation(self, noise: FloatArray) -> FloatArray:
        """(k,) V of the error, for independent ``noise`` (n_meas,) V."""
        return np.asarray(np.hypot(noise[self.first], noise[self.second]))

    def squared(
        self, error: FloatArray, deviation: FloatArray, moved: FloatArray, changed: FloatArray
    ) -> FloatArray:
        """(k,) squared deviations of the ``error``, cut off.

        ``moved`` (n_meas,) V is what each row has changed since the last look: the two rows are
        read at different times of a scan, so beyond its noise it may stand in the error.
        ``changed`` (n_meas,) V, since the reference: channels differ in gain, and show that.
        """
        sizes = np.abs([moved, changed])
        motion, change = np.maximum(sizes.take(self.first, axis=1), sizes.take(self.second, axis=1))
        allowed = np.maximum(motion - 4.0 * deviation, 0.0)
        noise = deviation**2 + allowed**2 + (_GAIN * change) ** 2
        return np.asarray(np.minimum(error**2 / noise, _MOST))

    def excess(self, squared: FloatArray) -> FloatArray:
        """(n_electrodes,) variance that each electrode adds, in units of the noise.

        Non-negative least squares of ``squared`` (k,) − 1 on who takes part: a healthy electrode
        between two bad ones is not blamed for them.
        """
        solution, _ = nnls(self.touches.T.astype(float), np.maximum(squared - 1.0, 0.0))
        return np.asarray(solution)


_EQUAL = 0.03
"""Part of what two electrodes usually differ by (rms over the drives), below which they read the
same: potentials of two electrodes can be equal under some drives, never under all."""

_BROKEN = 0.2
"""Part of its voltages by which reciprocity must fail for the electrode that is not reached; gains
of channels make 0.03, and two electrodes that touch each other none."""

_FEWEST_DRIVES = 3
"""Drives that must sample both."""


@dataclass(frozen=True, eq=False)
class EqualReadings:
    """Looks for them in the samples of a frame.

    Attributes
    ----------
    pairs
        (n_pairs, 2) electrodes.
    first, second
        (n_pairs, n_drives) number of each one's sample; 0 where not both are sampled.
    weight
        (n_pairs, n_drives) averages over the drives that sample both.
    """

    pairs: IntArray
    first: IntArray
    second: IntArray
    weight: FloatArray

    @classmethod
    def of(cls, scan: Scan, n: int) -> Self:
        """Of the scan of a pattern of ``n`` electrodes."""
        number = np.full((n, len(scan.drives)), -1)
        number[scan.sample_electrode, scan.sample_drive] = np.arange(scan.n_samples)
        pairs = np.column_stack(np.triu_indices(n, 1))
        both = np.asarray((number[pairs] >= 0).all(axis=1))
        enough = both.sum(axis=1) >= _FEWEST_DRIVES
        pairs, both = pairs[enough], both[enough]
        first, second = (np.where(both, number[pairs[:, k]], 0) for k in (0, 1))
        return cls(pairs, first, second, both / both.sum(axis=1, keepdims=True))

    def __call__(
        self, samples: NDArray[np.uint16], values: FloatArray, reciprocity: Reciprocity
    ) -> dict[int, ElectrodeHealth]:
        """Those that are not reached, of (n_samples,) counts and (n_meas,) V."""
        counts = samples.astype(float)
        apart = (self.weight * (counts[self.first] - counts[self.second]) ** 2).sum(axis=1)
        if not len(apart) or apart.min() >= _EQUAL**2 * np.median(apart):
            return {}
        least = _EQUAL**2 * np.median(apart)
        mean = (self.weight * counts[self.first]).sum(axis=1, keepdims=True)
        spread = (self.weight * (counts[self.first] - mean) ** 2).sum(axis=1)
        equal = (apart < least) & (spread > least)  # two that float stand at a rail
        broken = _broken(values, reciprocity)
        stuck = {}
        for one, other in self.pairs[equal].tolist():
            electrode, read = (one, other) if broken[one] >= broken[other] else (other, one)
            if broken[electrode] > _BROKEN:
                reason = f"it reads as E{read + 1} does under every drive, though it drives as "
                reason += "itself: the multiplexer does not reach it"
                stuck[electrode] = ElectrodeHealth(electrode, "stuck", reason)
        return stuck


def _broken(values: FloatArray, reciprocity: Reciprocity) -> FloatArray:
    """(n_electrodes,) part of the voltages by which the reciprocal ones differ."""
    error = reciprocity.mean @ np.abs(reciprocity.error(values))
    size = np.maximum(np.abs(values[reciprocity.first]), np.abs(values[reciprocity.second]))
    usual = np.maximum(reciprocity.mean @ size, np.finfo(float).tiny)
    return np.asarray(error / usual)
