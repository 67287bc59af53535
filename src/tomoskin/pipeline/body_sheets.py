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
    """Sheets that were fitted where the body has been, each with what it ``moved`` then.

    Parameters
    ----------
    rest
        The model of the sheet at rest.
    reference
        What that reads.
    """

    def __init__(self, rest: SpotModel, reference: Reference) -> None:
        self.rest, self._reference = rest, reference
        self._apart = _APART * float(np.linalg.norm(reference.mean))
        self._kept: list[tuple[FloatArray, SpotModel]] = [(np.zeros_like(reference.mean), rest)]
        self._now = 0

    def shifted(self, reference: Reference) -> Reference:
        """A ``reference`` at rest as it is where the sheet of the moment was fitted."""
        return replace(reference, mean=reference.mean + self._kept[self._now][0])

    def steps(self, prepared: Prepared, moved: FloatArray) -> Steps | None:
        """Pieces of work that lead to the sheet for a body that has ``moved`` the voltages by so
        much, (n_meas,) V; None where the sheet of the moment serves."""
        away = [float(np.linalg.norm(moved - own)) for own, _ in self._kept]
        nearest = int(np.argmin(away))
        if away[nearest] > self._apart and len(self._kept) < _MOST:
            return self._fitted(prepared, moved)
        if away[nearest] < _NEARER * away[self._now]:
            return self._taken(prepared, nearest)
        return None

    def _fitted(self, prepared: Prepared, moved: FloatArray) -> Steps:
        reference = self._reference
        deviation = np.nan_to_num(reference.noise)
        even = self.rest.even or self.rest
        sheet = yield from even.fitting(reference.mean + moved, deviation)
        self._kept.append((moved, sheet))
        yield from self._taken(prepared, len(self._kept) - 1)

    def _taken(self, prepared: Prepared, number: int) -> Steps:
        self._now = number
        yield replace(prepared, spots=self._kept[number][1])
