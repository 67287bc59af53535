"""Electrodes that read the same under every drive: a multiplexer does not reach one of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, IntArray
from tomoskin.model.pattern import Scan
from tomoskin.sensing.signal.evidence import Reciprocity
from tomoskin.sensing.signal.health import ElectrodeHealth

_EQUAL = 0.03
"""Part of what two electrodes usually differ by (rms over the drives), below which they read the
same: potentials of two electrodes can be equal under some drives, never under all."""

_BROKEN = 0.2
"""Part of its voltages by which reciprocity must fail for the electrode that is not reached; gains
of channels make 0.03, and two electrodes that touch each other none."""

_FEWEST = 3
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
        enough = both.sum(axis=1) >= _FEWEST
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
        found = {}
        for one, other in self.pairs[equal].tolist():
            electrode, read = (one, other) if broken[one] >= broken[other] else (other, one)
            if broken[electrode] > _BROKEN:
                reason = f"it reads as E{read + 1} does under every drive, though it drives as "
                reason += "itself: the multiplexer does not reach it"
                found[electrode] = ElectrodeHealth(electrode, "stuck", reason)
        return found


def _broken(values: FloatArray, reciprocity: Reciprocity) -> FloatArray:
    """(n_electrodes,) part of the voltages by which the reciprocal ones differ."""
    error = reciprocity.mean @ np.abs(reciprocity.error(values))
    size = np.maximum(np.abs(values[reciprocity.first]), np.abs(values[reciprocity.second]))
    usual = np.maximum(reciprocity.mean @ size, np.finfo(float).tiny)
    return np.asarray(error / usual)
