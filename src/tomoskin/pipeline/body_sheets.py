"""The sheets of a body that moves: touches are fitted on the one that is nearest to how it stands.

A sheet that is bent or stretched conducts otherwise along than across, and a touch on it changes
other voltages than on the sheet at rest: by the model of that, one touch looks like several.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.rest import Steps
from tomoskin.sensing.fit import SpotModel
from tomoskin.sensing.signal import Reference

_APART = 0.06
"""A sheet serves where the voltages are off from its own by this part of the reference at most."""

_MOST = 24
"""Sheets that are kept."""

_NEARER = 0.8
"""Another sheet is taken where it is nearer by this factor."""


class BodySheets:
    """Sheets that were fitted for some poses, each with what the body ``moved`` then.

    Parameters
    ----------
    rest
        The model of the sheet at rest.
    reference
        What that reads.
    poses
        (p, n_meas) V that the body moved while it was learnt: the farthest from all that are kept
        is fitted when there is nothing else to do.
    """

    def __init__(self, rest: SpotModel, reference: Reference, poses: FloatArray) -> None:
        self.rest, self._reference, self._poses = rest, reference, poses
        self._apart = _APART * float(np.linalg.norm(reference.mean))
        self._kept: list[tuple[FloatArray, SpotModel]] = [(np.zeros_like(reference.mean), rest)]
        self._away = np.linalg.norm(poses, axis=1)
        self._now = 0

    def shifted(self, reference: Reference) -> Reference:
        """A ``reference`` at rest as it is where the sheet of the moment was fitted."""
        return replace(reference, mean=reference.mean + self._kept[self._now][0])

    def steps(self, prepared: Prepared, moved: FloatArray) -> Steps | None:
        """Pieces of work that lead to a better sheet for a body that has ``moved`` the voltages by
        so much, (n_meas,) V, or to one that will serve later; None where there is none."""
        away = [float(np.linalg.norm(moved - own)) for own, _ in self._kept]
        nearest, farthest = int(np.argmin(away)), int(np.argmax(self._away))
        if away[nearest] < _NEARER * away[self._now]:
            return self._taken(prepared, nearest)
        if len(self._kept) > _MOST:
            return None
        if away[nearest] > self._apart:
            return self._fitted(moved)
        return self._fitted(self._poses[farthest]) if self._away[farthest] > self._apart else None

    def _fitted(self, moved: FloatArray) -> Steps:
        even, deviation = self.rest.even or self.rest, np.nan_to_num(self._reference.noise)
        sheet = yield from even.fitting(self._reference.mean + moved, deviation)
        self._kept.append((moved, sheet))
        self._away = np.minimum(self._away, np.linalg.norm(self._poses - moved, axis=1))

    def _taken(self, prepared: Prepared, number: int) -> Steps:
        self._now = number
        yield replace(prepared, spots=self._kept[number][1])
