"""A twin that is pressed step by step, without a clock, for programs that learn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tomoskin.core import FloatArray, Frame, Touch
from tomoskin.pipeline import REFERENCE_FRAMES, FrameResult, Pipeline, Prepared
from tomoskin.twin.presets import TwinSettings
from tomoskin.twin.probe import Probe
from tomoskin.twin.source import Scans


class Step(NamedTuple):
    """What one scan shows.

    Attributes
    ----------
    voltages
        (n_meas,) V.
    touches
        Tracked touches; empty where the voltages alone are asked for.
    """

    voltages: FloatArray
    touches: tuple[Touch, ...]


class SteppedSkin:
    """Scan after scan of a twin, each under the presses that it is given.

    A step is the time of one scan. There is neither board nor wire; the frames go through the
    pipeline of a live run, so that touches are what a robot would be given.

    Parameters
    ----------
    prepared
        What was made once for the skin.
    settings
        Of the twin; without them those of the skin's preset. The seed is that of its channels
        and spread, and of the first episode.
    with_touches
        Whether touches are looked for, which takes most of the time.

    Attributes
    ----------
    period
        Seconds of a scan.
    frame, result
        The newest scan as a board sends it, and all that the pipeline makes of it; None where the
        voltages alone are asked for.
    """

    frame: Frame
    result: FrameResult | None = None

    def __init__(
        self,
        prepared: Prepared,
        settings: TwinSettings | None = None,
        *,
        with_touches: bool = True,
    ) -> None:
        skin = prepared.skin
        self._prepared, self._with_touches = prepared, with_touches
        if with_touches:
            prepared.warm_up()
        self._seed = (settings or TwinSettings()).seed
        self._scans = Scans(skin, settings or TwinSettings.preset(skin.twin.preset))
        self.period = self._scans.table.seconds
        self.reset()

    def reset(self, seed: int | None = None) -> Step:
        """Lift everything and forget the past; the last of the frames that make the reference.

        ``seed``: of the episode's noise and temperature; without it that of the episode before.
        """
        self._seed = self._seed if seed is None else seed
        self._scans.renew(np.random.SeedSequence(self._seed))
        self._pipeline = Pipeline(self._prepared)
        self._steps = 0
        return [self.step(()) for _ in range(REFERENCE_FRAMES if self._with_touches else 1)][-1]

    def step(self, presses: Sequence[Probe]) -> Step:
        """One scan while ``presses`` press.

        Raises
        ------
        GeometryError
            When the centre of one is off the skin; then nothing is changed.
        """
        self._scans.electronics.sheet.set_presses(tuple(presses))
        time = self._steps * self.period
        self._steps += 1
        self.frame = frame = self._scans.frame(self._steps, time)
        if not self._with_touches:
            return Step(self._prepared.readout(frame).values, ())
        result = self._pipeline.push(frame)
        if result is None:
            raise AssertionError("a frame of the skin's own scan is never left out")
        self.result = result
        return Step(result.voltages, result.touches)
