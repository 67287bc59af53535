"""A touch that begins, drive by drive: evidence of an onset before the scan ends.

The newest sample of each measurement is kept. A touch that began some drives ago shows in the
measurements of these drives, and in no older one. Which drive it was is not known: so each is
tried, and the likelihood ratio of the best one counts (Page 1954; Willsky & Jones 1976). Older
measurements say what all have in common for long, such as a gain. What drives share for a moment,
such as hum, has another phase in each scan: it is no help, and counts as noise.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from scipy.special import ndtri

from tomoskin.core import FloatArray, IntArray
from tomoskin.sensing.fit.candidates import Candidates
from tomoskin.sensing.fit.spot import CONTENT

FALSE_AN_HOUR = 0.1
"""False onsets that noise alone may cause."""

_MISSHAPEN = 0.1
"""Part of a touch's change by which the signature of a faint one may be wrong."""

_GRID = 0.004
"""Standard deviation of a position between two candidates, m."""

_ORDERS = 64
"""Sequences of drives whose sizes are kept."""


@dataclass(frozen=True, eq=False)
class DriveEvidence:
    """What each drive tells of a touch at each of n candidates.

    Attributes
    ----------
    spots, signatures
        The candidates, (n, 4) of content 1 and (n, n_meas) V/m².
    precision
        (n_meas, n_meas) 1/V², of the measurements as if drives shared only what stays.
    firsts
        (n_drive,) number of the first measurement of each drive.
    gram, wavers
        (n, n_drive, n_drive) products of the signatures' parts by the precision, and the variance
        of what they match, with all that drives share.
    """

    spots: FloatArray
    signatures: FloatArray
    precision: FloatArray
    firsts: IntArray
    gram: FloatArray
    wavers: FloatArray

    @classmethod
    def making(
        cls, candidates: Candidates, noise: FloatArray, stays: FloatArray, drives: IntArray
    ) -> Generator[None, None, Self]:
        """A piece of work for each drive; ``noise`` of a frame and what ``stays`` from frame to
        frame, (n_meas, n_meas) V², and ``drives`` (n_meas,)."""
        signatures, apart = candidates.signatures, drives[:, None] != drives
        precision = np.asarray(np.linalg.inv(np.where(apart, 0.0, noise) + stays))
        wavering = precision @ (noise + stays) @ precision
        firsts = np.flatnonzero(np.diff(drives, prepend=-1))
        gram, wavers = np.empty((2, len(signatures), len(firsts), len(firsts)))
        for drive, rows in enumerate(_slices(firsts, len(drives))):
            for products, matrix in ((gram, precision), (wavers, wavering)):
                yield
                parts = signatures * (signatures[:, rows] @ matrix[rows])
                products[:, drive] = np.add.reduceat(parts, firsts, axis=1)
        return cls(candidates.spots, signatures, precision, firsts, gram, wavers)

    @cached_property
    def rows(self) -> list[slice]:
        """The measurements of each drive."""
        return _slices(self.firsts, len(self.precision))

    def sizes(self, order: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """(n, k) squared deviations of candidates of content 1 in the first one, two, … drives of
        an ``order`` (k,), and (n, k) variances of what they match there."""
        gram, wavers = (
            part[:, order][:, :, order].cumsum(axis=1).cumsum(axis=2).diagonal(axis1=1, axis2=2)
            for part in (self.gram, self.wavers)
        )
        return np.maximum(gram, 1e-300), np.maximum(gram, wavers)

    def threshold(self, drives_a_second: float, least: float) -> float:
        """Deviations that noise exceeds :data:`FALSE_AN_HOUR` times in an hour; no less than
        ``least``. Each drive tests no more directions than there are measurements."""
        tests = 3600 * drives_a_second * len(self.precision)
        return max(least, float(-ndtri(FALSE_AN_HOUR / tests)))


def _slices(firsts: IntArray, count: int) -> list[slice]:
    ends = [*firsts[1:].tolist(), count]
    return [slice(first, end) for first, end in zip(firsts.tolist(), ends, strict=True)]


class Onset(NamedTuple):
    """A touch that has begun: its middle (2,) m and the covariance (2, 2) m² of that, the likeliest
    spot (4,), by how many deviations it stands out, and how many drives show it as a whole."""

    middle: FloatArray
    covariance: FloatArray
    spot: FloatArray
    ratio: float
    drives: int


class Initiation:
    """The newest measurements of an untouched skin, and whether a touch has begun in them.

    Parameters
    ----------
    evidence
        Of the drives.
    threshold
        Deviations from which a touch has begun.
    sign
        Of touches, as in a skin's ``[touch]``.
    """

    def __init__(self, evidence: DriveEvidence, threshold: float, sign: str) -> None:
        self._evidence, self._threshold, self._sign = evidence, threshold, sign
        self._data = np.zeros(len(evidence.precision))
        self._matched = np.zeros(len(evidence.precision))
        self._sizes: dict[tuple[int, ...], tuple[FloatArray, FloatArray]] = {}
        self.forget()

    def forget(self) -> None:
        """Begin anew with an untouched skin: drives that were read tell nothing."""
        self._order: tuple[int, ...] = ()
        self._since: int | None = None

    @property
    def begun(self) -> bool:
        """Whether a touch has begun that is to be told."""
        return self._since is not None

    def go_on(self, other: Initiation) -> None:
        """Go on where an ``other`` one of the same skin is."""
        self._data, self._order, self._since = other._data, other._order, other._since
        self._matched = self._evidence.precision @ self._data

    def push(self, drive: int, data: FloatArray) -> Onset | None:
        """Take the ``data`` (m,) V of a drive; a touch, once one has begun.

        A touch comes down while a drive is read: that drive shows a part of it, and counts for its
        existence but not for its position. So a touch is not told before the drive after that.
        """
        evidence, rows = self._evidence, self._evidence.rows[drive]
        self._matched += evidence.precision[:, rows] @ (data - self._data[rows])
        self._data[rows] = data
        self._order = (drive, *(d for d in self._order if d != drive))
        if len(self._order) < len(evidence.firsts):
            return None
        parts = np.add.reduceat(evidence.signatures * self._matched, evidence.firsts, axis=1)
        content, ratio = self._likely(parts)
        if self._since is None:
            best = int(np.argmax(ratio.max(axis=0)))
            if ratio[:, best].max() < self._threshold:
                return None
            self._since = best
        else:
            self._since = min(self._since + 1, len(self._order) - 1)
        if not self._since:
            return None
        return self._onset(content[:, self._since - 1], ratio[:, self._since - 1], self._since)

    def _likely(self, parts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(n, k) most likely content of each candidate since one, two, … drives, m², and by how
        many deviations it stands out; ``parts`` (n, n_drive) products with the data."""
        order = self._order
        if order not in self._sizes:
            if len(self._sizes) >= _ORDERS:
                self._sizes.clear()
            self._sizes[order] = self._evidence.sizes(order)
        (size, variance), onto = self._sizes[order], parts[:, order].cumsum(axis=1)
        if self._sign != "both":
            onto = np.minimum(onto, 0.0) if self._sign == "decrease" else np.maximum(onto, 0.0)
        return onto / size, np.abs(onto) / np.sqrt(np.maximum(variance, 1e-300))

    def _onset(self, content: FloatArray, ratio: FloatArray, drives: int) -> Onset:
        """The position by all candidates, each as likely as the data say; a strong touch differs
        from the signature of a faint one, which is taken for noise."""
        spots, best = self._evidence.spots, int(np.argmax(ratio))
        doubt = 1.0 + (_MISSHAPEN * ratio[best]) ** 2
        weight = np.exp((ratio**2 - ratio[best] ** 2) / (2.0 * doubt))
        weight /= weight.sum()
        middle = weight @ spots[:, :2]
        away = spots[:, :2] - middle
        covariance = away.T @ (weight[:, None] * away) + _GRID**2 * np.eye(2)
        spot = spots[best].copy()
        spot[CONTENT] = content[best]
        return Onset(middle, covariance, spot, float(ratio[best]), drives)
