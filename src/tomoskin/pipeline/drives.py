"""Touches before a scan ends: what each drive tells, beside the frames.

Frames alone decide what is recorded and learnt: nothing here changes what becomes of them. Drives
say earlier that a touch has begun or is lifted, and where it is now. The next frames confirm a
touch that has begun, or withdraw it.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tomoskin.core import Detection, FloatArray, Touch
from tomoskin.model.pattern import Pattern
from tomoskin.sensing import fit
from tomoskin.sensing.track import GATE, RESIDUAL

_LIFTED = 5.0
"""Logarithm of the odds from which a touch is lifted; or only as much is there as may be left."""

_MOST = 4.0
"""The most that one drive says of that: a single one may be wrong."""

_ALONE, _BESIDE = 0.15, 0.2
"""Seconds after which the scan of a frame must show a touch that has begun, or it is withdrawn:
quick ones tell little each, and it takes longer beside another touch. So long after a touch has
begun, drives look for a further one."""

_SETTLED, _PAST = 3, 16
"""Drives after which a touch is known so well that another one shows beside it, and those of which
its states are kept."""

_FURTHER = 25.0
"""Squared deviations by which a drive would move a touch from where it is known to be, beyond which
another one moves it: of one that comes, stands or slides they are 2 at most."""

_CALM = 8
"""Frames since touches came or went in which more noise may be what these look like: a scan that
sees a touch come down disagrees with itself, and it takes so many frames to forget that."""

_STEP = 1e-4
"""Seconds of a drive that allow one step of what is made anew, where drives wait for it: with 8
electrodes a step takes so long, and with 16 three times as long."""


@dataclass(frozen=True, slots=True, eq=False)
class DriveResult:
    """What is known once a drive has been read.

    Attributes
    ----------
    drive
        Its number.
    host_time
        Host monotonic seconds at which its last byte was read.
    touches
        Where they are now.
    withdrawn
        Those that drives have told of, and no frame has confirmed in time.
    scanned, scan_time
        Its middle by the host's clock, and how long it took, s.
    """

    drive: int
    host_time: float
    touches: tuple[Touch, ...]
    withdrawn: tuple[Touch, ...] = ()
    scanned: float = math.nan
    scan_time: float = math.nan


@dataclass(slots=True, eq=False)
class _Followed:
    """A touch as frames have it, and as drives have it; ``full``: its content in the frame, and
    ``begun``: the device time, s, at which a provisional one has.

    ``odds``: their logarithm that it is lifted, and the device time, s, at which it was;
    ``doubtful``: whether the newest drive is left out; ``past``: what it was before each drive,
    the newest first.
    """

    touch: Touch
    moving: fit.MovingTouch
    full: float
    begun: float = 0.0
    odds: float = 0.0
    doubtful: bool = False
    lifted: float | None = None
    past: tuple[fit.MovingTouch, ...] = ()

    def take(
        self, moved: fit.MovingTouch, told: fit.MovingTouch, gone: float, going: float
    ) -> None:
        """Take a drive: the touch as it has ``moved`` and as the drive has ``told``, and what that
        says of the odds: it was lifted before, or while the drive was read.

        What shows a part of a touch would draw it elsewhere, and later drives would speak of what
        is there. So such a drive is left out, and the odds begin with it. The next one counts.
        While a further touch is looked for, what shows one is left out too.
        """
        self.past = (moved, *self.past)[:_PAST]
        self.doubtful = going > _MOST and not self.doubtful
        off = told.state[:2] - moved.state[:2]
        is_further = going < 0 and moved.time - self.begun < _BESIDE
        is_further &= bool(off @ np.linalg.solve(moved.covariance[:2, :2], off) > _FURTHER)
        self.moving = moving = moved if self.doubtful or is_further else told
        if self.lifted is None:
            self.odds = max(self.odds + min(gone, _MOST), min(going, _MOST), 0.0)
            is_left = RESIDUAL.holds(abs(moving.content), abs(self.full))
            if self.odds > _LIFTED or (is_left and not self.touch.provisional):
                self.lifted = moving.time

    def stands(self, touch: Touch, content: float, time: float) -> bool:
        """Whether a frame whose scan began at ``time`` s has a ``touch`` of a ``content`` m² that
        is not lifted: it was in that frame, and is more than what is left of it."""
        is_missing = touch.detection.snr == self.touch.detection.snr
        if self.lifted is None or time < self.lifted or is_missing:
            return self.lifted is None
        return not RESIDUAL.holds(abs(content), abs(self.full))


class DriveWatch:
    """What drives tell between frames; one for each finder.

    Parameters
    ----------
    view
        Of the finder of the frames.
    pattern
        Of the skin.
    interval
        Between frames, s.
    follows
        Whether positions are those of a fit, which drives tell too.
    """

    def __init__(
        self, view: fit.DriveView, pattern: Pattern, interval: float, *, follows: bool
    ) -> None:
        self.view, self._follows = view, follows
        self._drives = pattern.drive_index
        self._length = interval / pattern.n_drive
        self._steps = max(1, int(self._length / _STEP))
        self._key: fit.NoiseKey | None = None
        self._blocked = True
        self._making: Generator[None, None, fit.DriveEvidence] | None = None
        self._initiation: fit.Initiation | None = None
        self._filter: fit.DriveFilter | None = None
        self._followed: dict[int, _Followed] = {}
        self._calm = 0
        self._withdrawn: tuple[Touch, ...] = ()

    @property
    def follows_some(self) -> bool:
        """Whether there are touches that drives move on."""
        return bool(self._followed)

    def push(
        self,
        drive: int,
        dv: FloatArray,
        clock: tuple[float, float],
        numbered: int,
        *,
        late: bool = False,
    ) -> DriveResult | None:
        """Take a drive; what is known then, or None before drives tell anything.

        ``dv`` (n_meas,) difference data of which those of this drive are new; ``clock``: device
        and host time, s, of its start and of its last byte; ``numbered``: the last identity given.
        ``late``: a newer one is there, so touches are not followed through this one.
        """
        initiation = self._initiation if self._ready() else None
        if initiation is None:
            return None
        rows, (time, host_time), onset = initiation.rows[drive], clock, None
        data = self.view.change(dv)[rows]
        if not self._followed:
            onset = initiation.push(drive, data, late=late)
        elif not late:
            onset = self._follow(initiation, rows, data, time)
        if onset is not None:
            initiation.forget()
            for each in self._followed.values():  # the further one has drawn them to itself
                each.moving = each.past[: onset.drives + 1][-1]
            self._begin(onset, time, host_time, max([numbered, *self._followed]) + 1)
        if late:
            return None
        withdrawn, self._withdrawn = self._withdrawn, ()
        touches = tuple([self._shown(e, time) for e in self._followed.values() if e.lifted is None])
        return DriveResult(drive, host_time, touches, withdrawn)

    def among(self, touches: Sequence[Touch]) -> tuple[Touch, ...]:
        """The ``touches`` of the newest frame as the drives know better: without those that have
        been lifted, and with provisional ones."""
        followed = self._followed.values()
        lifted = {each.touch.id for each in followed if each.lifted is not None}
        new = [each.touch for each in followed if each.touch.provisional and each.lifted is None]
        return *[touch for touch in touches if touch.id not in lifted], *new

    def confirm(self, touches: Sequence[Touch], time: float, numbered: int) -> int:
        """Take the ``touches`` of a frame whose scan began at ``time`` s of the board; the last
        identity that is given then, by frames (``numbered``) or to what is withdrawn."""
        before = self._followed
        middle = time + self._length * self._drives[-1] / 2
        heirs = self._heirs(touches, middle)
        shown = [heirs.get(t.id, before.get(t.id)) for t in touches]
        waiting = [e for e in before.values() if e.touch.provisional and e not in shown]
        self._followed = {t.id: self._going_on(t, heirs.get(t.id), time, middle) for t in touches}
        for number, each in enumerate(waiting, start=numbered + 1):
            each.touch = replace(each.touch, id=number)
            if time - each.begun < (_BESIDE if touches else _ALONE):
                self._followed[number] = each
            else:
                numbered, self._withdrawn = number, (*self._withdrawn, each.touch)
        self._calm = self._calm + 1 if before.keys() == self._followed.keys() else 0
        if not self._calm and self._initiation is not None:
            self._initiation.forget()
        return numbered

    def _ready(self) -> bool:
        """Whether the noise is that of now, or less; some pieces of work where it is not."""
        key = self.view.key
        is_newer = self._key is None or not _is_same(key, self._key)
        says_less = self._key is None or _says_less(key, self._key)
        if says_less and self._key is not None and key[0] is self._key[0] and self._followed:
            is_newer &= self._calm >= _CALM
        if is_newer and (says_less or self._making is None):  # else it is made first
            begun = self._initiation is not None and self._initiation.begun
            if not (begun or self._followed):  # a touch that comes down looks like more noise
                self._blocked |= says_less
            self._key, model = key, self.view.model
            noise, stays = self.view.noise()
            self._making = fit.DriveEvidence.making(model.candidates, noise, stays, self._drives)
            sign = self.view.skin.touch.sign
            self._filter = fit.DriveFilter(model.solver, model.prior, sign, model.sheet, noise)
        for _ in range(self._steps if self._blocked else 1):
            if self._making is None:
                break
            try:
                next(self._making)
            except StopIteration as end:
                self._making, self._blocked = None, False
                self._initiation = self._renewed(end.value)
        return not self._blocked or bool(self._followed)

    def _renewed(self, evidence: fit.DriveEvidence) -> fit.Initiation:
        touch = self.view.skin.touch
        made = fit.Initiation(evidence, evidence.threshold(1 / self._length, touch.snr), touch.sign)
        if self._initiation is not None:
            made.go_on(self._initiation)
        return made

    def _begin(self, onset: fit.Onset, time: float, host_time: float, number: int) -> None:
        moving = fit.MovingTouch.of_onset(time + self._length / 2, onset, self.view.model.prior)
        detection = self.view.shown(moving.spot, onset.covariance, onset.ratio)
        kind = "decrease" if moving.content < 0 else "increase"
        since = host_time - onset.drives * self._length
        touch, self._calm = Touch(number, kind, since, detection, provisional=True), 0
        self._followed[number] = _Followed(touch, moving, moving.content, time)

    def _follow(
        self, initiation: fit.Initiation, rows: slice, data: FloatArray, time: float
    ) -> fit.Onset | None:
        """Let each touch take its part of the data: what the others do not change. A further touch,
        once one has begun soon after another: beside one that stays, frames tell of it, since one
        that turns on its way looks like a further one too."""
        assert self._filter is not None  # it is made before the initiation
        moved = {n: f.moving.at(time + self._length / 2) for n, f in self._followed.items()}
        answers = {n: self._filter.response(t.state, t.covariance, rows) for n, t in moved.items()}
        every = np.sum([change for change, *_ in answers.values()], axis=0)
        doubt = np.sum([doubt for *_, doubt in answers.values()], axis=0)
        is_settled = any(time - each.begun < _BESIDE for each in self._followed.values())
        for n, each in self._followed.items():
            own, others = data - every + answers[n][0], doubt - answers[n][2]
            told, *odds = self._filter.pushed(moved[n], rows, own, answers[n], others)
            each.take(moved[n], told, *odds)
            is_settled &= each.lifted is None and odds[0] <= 0 and len(each.past) > _SETTLED
        if not is_settled:  # what goes, or is hardly known, looks like a change
            initiation.forget()
            return None
        return initiation.push_beside(rows, data - every, self._filter.noise[rows, rows] + doubt)

    def _heirs(self, touches: Sequence[Touch], time: float) -> dict[int, _Followed]:
        """What drives follow, by the number of the nearest of ``touches`` at a ``time`` s; one
        follows its own where it may. None where drives do not know one of them, since what they
        follow has taken that in."""
        heirs: dict[int, _Followed] = {}
        for each in self._followed.values() if touches else ():
            far = [_off(each.moving, touch.detection, time) for touch in touches]
            number = touches[int(np.argmin(far))].id
            if min(far) < GATE and (number not in heirs or number == each.touch.id):
                heirs[number] = each
        return heirs if len(heirs) == len(touches) else {}

    def _going_on(
        self, touch: Touch, heir: _Followed | None, time: float, middle: float
    ) -> _Followed:
        """A touch of a frame whose scan began at ``time`` s and was half done at ``middle`` s: as
        the drives have what is nearest to it, its ``heir``, else as the frame has it."""
        known = self._followed.get(touch.id, heir)
        moving = fit.MovingTouch.begin(
            middle, self.view.spot(touch.detection), _spread(touch.detection), self.view.model.prior
        )
        if known is not None and not known.stands(touch, moving.content, time):
            known.touch = touch
            return known
        if heir is not None and heir.lifted is None:
            return replace(heir, touch=touch, full=moving.content)
        return _Followed(touch, moving, moving.content)

    def _shown(self, each: _Followed, time: float) -> Touch:
        """A touch where it is at the end of a drive that began at ``time`` s."""
        if not (each.touch.provisional or self._follows):
            return each.touch
        now = each.moving.at(time + self._length)
        frame = each.touch.detection
        detection = self.view.shown(now.spot, now.position()[1], frame.snr)
        return replace(each.touch, detection=replace(detection, force=frame.force))


def _is_same(key: fit.NoiseKey, before: fit.NoiseKey) -> bool:
    same = all(one is other for one, other in zip(key[:-1], before[:-1], strict=True))
    return same and key[-1] == before[-1]


def _says_less(key: fit.NoiseKey, before: fit.NoiseKey) -> bool:
    """Whether drives told less in the noise of a ``key`` than in that ``before``: then they must
    not be read by that."""
    (nuisance, *_, excess, left), (*_, less, known) = key, before
    louder = excess.level > less.level or bool((excess.variance > less.variance).any())
    return nuisance is not before[0] or louder or sum(left) > sum(known)


def _off(moving: fit.MovingTouch, detection: Detection, time: float) -> float:
    """Squared Mahalanobis distance of a ``detection`` at a ``time`` s from what drives follow."""
    where, spread = moving.position()
    off = where - [detection.x, detection.y] - moving.state[2:4] * (moving.time - time)
    return float(off @ np.linalg.solve(spread + _spread(detection), off))


def _spread(detection: Detection) -> FloatArray:
    xy = detection.cov_xy
    return np.array([[detection.sd_x**2, xy], [xy, detection.sd_y**2]])
