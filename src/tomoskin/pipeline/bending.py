"""Bends of a skin that is watched: how far, and what of each frame is theirs."""

from __future__ import annotations

from tomoskin.calibration import BendReader, BendReading
from tomoskin.core import Detection
from tomoskin.pipeline.finding import Finder, InData, View, told_gain
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.watch import Seen, Watch
from tomoskin.signal import Reference


class Bends:
    """Reads how the sheet is bent, beside the touches of each frame.

    Where the skin finds its touches in the picture, they are fitted to the data here as well: an
    angle is told beside a touch only where what the touch changes is known.
    """

    def __init__(self, prepared: Prepared, reference: Reference, finder: Finder) -> None:
        if prepared.bending is None or prepared.spots is None:
            raise AssertionError("made for skins whose bends were learnt")
        if isinstance(finder, InData):
            spots = finder.model
        else:
            spots = prepared.spots.fitted_to(reference.mean)
        known = prepared.skin.touch.method == "fit"
        self._own = None if known else InData(spots, prepared, reference)
        self._reader = BendReader(prepared.bending, spots.response, told_gain(spots, reference))

    def push(
        self,
        watch: Watch,
        seen: Seen,
        view: View,
        found: list[Detection],
        time: float,
        *,
        touched: bool,
    ) -> BendReading | None:
        """How the sheet is bent at ``time`` s; ``found`` is what the frame shows by itself,
        ``touched`` whether any of it is a touch, as tracked."""
        if seen.whole is None:
            return None
        touches = found if self._own is None else self._own.push(view)
        beside = watch.beside_bends
        detection = self._reader.push(seen.whole, touches, beside, time, touched=touched)
        watch.bent(detection.moved)
        return detection


def bends_of(prepared: Prepared, reference: Reference, finder: Finder) -> Bends | None:
    """What reads the bends beside the touches of ``finder``, where they have been learnt."""
    return None if prepared.bending is None else Bends(prepared, reference, finder)
