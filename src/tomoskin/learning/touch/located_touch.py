"""The kind of calibration that tells where a touch is, from labelled presses."""

from __future__ import annotations

from collections import deque
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import Detection, FloatArray, IntArray
from tomoskin.learning.kind import Applied, Calibration, Conditions, FrameView, Kind, Progress
from tomoskin.learning.touch.calibration_health import CalibrationHealth
from tomoskin.learning.touch.fit_trial import FitTrial, together
from tomoskin.learning.touch.locator import Locator
from tomoskin.learning.touch.presses import Presses
from tomoskin.learning.touch.watch import LIVE, Watch
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.sensing.segment import Region

_FRAMES = 8
"""Frames in a mean: as many as a guided press is learnt from."""

_MOVED = 1.5
"""How many times what noise explains frames may differ by that are of one position."""

_NOISES = 30
"""Newest frames that tell the noise."""


class Standing:
    """The mean of the newest frames in which a touch stood still.

    The noise is told from second differences over time, in which an even motion does not show.
    """

    def __init__(self) -> None:
        self._frames: deque[FloatArray] = deque(maxlen=_FRAMES)
        self._newest: deque[FloatArray] = deque(maxlen=3)
        self._noises: deque[float] = deque(maxlen=_NOISES)

    def clear(self) -> None:
        """Forget the touch, since it has ended."""
        self._frames.clear()
        self._newest.clear()

    @property
    def stands(self) -> bool:
        """Whether the mean is one of as many frames as it can be."""
        return len(self._frames) == _FRAMES

    def push(self, dv: FloatArray) -> FloatArray:
        """(n_meas,) mean of the newest frame ``dv`` (n_meas,), NaN where a value is missing, and
        of those before it that differ from it by noise alone."""
        frames = self._frames
        if frames and (np.isfinite(frames[-1]) != np.isfinite(dv)).any():
            self.clear()
        frames.append(dv)
        self._newest.append(dv)
        if len(self._newest) == self._newest.maxlen:
            first, second, third = self._newest
            self._noises.append(float(np.nanmean((first - 2 * second + third) ** 2)) / 6)
        while len(frames) > 1 and self._moves():
            frames.popleft()
        return np.asarray(np.mean(frames, axis=0))

    def _moves(self) -> bool:
        """Whether the newest frame, or the newer half, is unlike those before."""
        if not self._noises:
            return True
        frames, noise = np.array(self._frames), float(np.median(self._noises))
        n = len(frames)
        for newer in {1, n // 2}:
            step = frames[-newer:].mean(axis=0) - frames[:-newer].mean(axis=0)
            expected = noise * (1 / newer + 1 / (n - newer))
            if float(np.nanmean(step**2)) > _MOVED**2 * expected:
                return True
        return False


_ALL = 0.999
"""Part of a measurement that is taken for all of it."""

_EVERY = 8
"""Of the frames in which a touch stands so many are one from which something is concluded."""

_SAME_SHAPE = 1e-4
"""Outlines within so many metres of each other are one."""


class LocatedTouch(Applied):
    """Detections tell that there are touches, labelled presses where each of them is.

    Of several fitted touches, each is located in the frame without what the others change. Regions
    of an image tell nothing of that: then the strongest is located, as if it were the only one.
    Fitted touches stay where they are if presses were labelled by the same model, from a rub.
    They also do where the calibration does not help beside the fit.
    Measurements that have jumped since the presses are left out where frames do not fit with them.
    A mean of frames in which a touch stands is located, unless frames are ``unrelated``.
    """

    def __init__(self, locator: Locator, trial: FitTrial | None, *, unrelated: bool) -> None:
        self._trial, self.slide_lag = trial, locator.presses.slide_lag or 0.0
        self._modelled = locator.presses.modelled
        self._rubbed = locator.presses.spread is not None
        self._watch = Watch(locator, LIVE)
        self._standing, self._stood = Standing(), 0
        self._unrelated = unrelated

    def locate(self, view: FrameView, detections: list[Detection]) -> list[Detection]:
        """The detections, each at the position that the presses tell."""
        if not detections:
            self._standing.clear()
            self._stood = 0
            return []
        # The presses were learnt with all that is in them: nothing is taken out here either.
        differences = view.differences
        dv = np.where(_excluded(differences.nuisance), np.nan, differences.change)
        if not np.isfinite(dv).any():
            return []
        mean = dv if self._unrelated else self._standing.push(dv)
        trial = self._trial
        if view.others is None or trial is None:
            (position,), (covariance,) = self._watch(mean, settled=self._settled())
            return [_at(detections[0], position, covariance)]
        settled = len(detections) == 1 and self._settled()
        answers = zip(*self._watch(mean - view.others, settled=settled), strict=True)
        if self._modelled or not trial.helps:
            return detections
        doubtful = self._rubbed or len(detections) > 1
        return [
            _at(detection, *together(trial.correction(detection), answer, doubtful=doubtful))
            for detection, answer in zip(detections, answers, strict=True)
        ]

    def _settled(self) -> bool:
        """Whether the touch stands still, now and then."""
        stands = self._standing.stands
        self._stood += stands
        return stands and self._stood % _EVERY == 1

    def read(
        self, view: FrameView, detections: list[Detection], *, touched: bool
    ) -> CalibrationHealth:
        """How the last touches fit the presses."""
        del view, detections, touched
        trial = self._trial
        unused = "" if trial is None or trial.helps else trial.text
        return replace(self._watch.health, alone=trial is None, unused=unused)


def _at(detection: Detection, position: FloatArray, covariance: FloatArray) -> Detection:
    """The detection at another position (2,) m, with its covariance (2, 2) m²."""
    x, y = position.tolist()
    sd_x, sd_y = np.sqrt(np.diag(covariance)).tolist()
    cov_xy = float(covariance[0, 1])
    return replace(detection, x=x, y=y, sd_x=sd_x, sd_y=sd_y, cov_xy=cov_xy, bias=0.0, lasting=None)


def _learn(
    presses: Presses, region: Region, pattern: Pattern, progress: Progress, skin_id: str = ""
) -> Locator:
    return Locator.learn(presses.within(region), region, pattern, skin_id, progress)


def _check(calibration: Calibration[Locator], skin: Skin) -> None:
    """It rests on measurements and positions alone: other settings of the image do not matter."""
    locator = calibration.model
    outline, known = Region.of(skin).outline, locator.region.outline
    same = outline.shape == known.shape and np.allclose(outline, known, atol=_SAME_SHAPE)
    if locator.skin_id and not same:
        raise calibration.mismatch("shape of the sheet", skin)


def _exclude(_locator: Locator, _measurements: IntArray) -> None:
    """The locator's features rest on all measurements."""


def _apply(locator: Locator, conditions: Conditions) -> Applied:
    trial = FitTrial.of(locator, conditions)
    return LocatedTouch(locator, trial, unrelated=conditions.unrelated)


def _excluded(nuisance: FloatArray) -> NDArray[np.bool_]:
    """(n_meas,) measurements of which the nuisance directions (n_meas, k), orthonormal, leave
    nothing."""
    return np.asarray((nuisance**2).sum(axis=1) > _ALL)


TOUCH = Kind(
    name="touch",
    title="tomoskin touch calibration",
    subject="touch",
    attachment="calibration.npz",
    learn=_learn,
    check=_check,
    exclude=_exclude,
    apply=_apply,
    locates=True,
)
"""Touch positions from labelled presses; its model is a :class:`Locator`."""
