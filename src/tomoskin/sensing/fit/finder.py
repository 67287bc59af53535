"""Frames of difference data → detections, each fitted by its parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import replace
from functools import partial
from operator import is_

import numpy as np

from tomoskin.core import Detection, FloatArray, reach, show
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import policy as decisions
from tomoskin.sensing.fit.certificate import Reduced
from tomoskin.sensing.fit.deformation import StrainLaw
from tomoskin.sensing.fit.deformed_frame import FrameData, Searched
from tomoskin.sensing.fit.deforming import Deforming
from tomoskin.sensing.fit.expectation import Expectation, ResidualResponse
from tomoskin.sensing.fit.hypotheses import (
    CommonModeJump,
    Explained,
    Rival,
    challenged,
    weighed,
)
from tomoskin.sensing.fit.problem import Matched, Problem
from tomoskin.sensing.fit.selection import ForwardSelection, SpotDetections, judged
from tomoskin.sensing.fit.sight import CellDiscs, DriveView, Sight
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS, N_PARAMETERS
from tomoskin.sensing.fit.spot_fit import Deficit
from tomoskin.sensing.fit.spot_model import SpotModel
from tomoskin.sensing.fit.strain_state import StrainState
from tomoskin.sensing.fit.unexplained import FrameWatch

_GROWS = 0.5
"""Standard deviation of what a touch that has just begun grows by within a scan, in parts of it."""

_REST = 0.5
"""A touch that stood still in the frame before moves, and grows, by this part of that at least."""

_ERRS = 0.4
"""Part of the rest of a covariance, as a variance, that means over many frames are off by; the
other part counts as noise. Chosen on the twin's seeds 4801 and 4804 (docs/theory/tracking.md)."""

_LASTING = 0.1
"""Part of the variance of a frame's noise that the next frames have too: 1/20 is the reference's,
and as much is slower than frames. Correlations over 2 s on the twin's seed 4801 have 0.05."""

_SWELLS = 0.08
"""Standard deviation of the logarithm of a touch's radius from frame to frame."""


class Stacked:
    """Rows over rows. The newest are kept: they stay from frame to frame, as a rule."""

    def __init__(self) -> None:
        self._newest: tuple[tuple[FloatArray, ...], FloatArray] | None = None

    def __call__(self, *rows: FloatArray) -> FloatArray:
        """(k, c) of all ``rows``."""
        newest = self._newest
        if newest is None or not all(map(is_, rows, newest[0])):
            newest = self._newest = rows, np.concatenate(rows)
        return newest[1]


class SpotFinder:
    """Finds the touches of one frame after the other; the last frame's are where it begins.

    Parameters
    ----------
    model
        Made once for the skin.
    skin
        Whose ``[touch]`` states sign, snr and how many.
    mesh
        Of the images: detections name its cells.
    noise
        (n_meas, n_meas) covariance of difference data, the reference's own part included.
    gain
        Of the data against the model: the ratio of their references.
    pace
        How much is tried in a frame, and how fast frames are.

    Attributes
    ----------
    watch
        What touches do not explain.
    view
        What it knows of measurements that are newer than its frames.
    """

    def __init__(
        self,
        model: SpotModel,
        skin: Skin,
        mesh: Mesh,
        noise: FloatArray,
        gain: float = 1.0,
        *,
        pace: decisions.Pace = decisions.EXHAUSTIVE,
    ) -> None:
        self._model, self._policy = model, decisions.DetectionPolicy.of(skin.touch, pace)
        self._rim = model.reduced.rim
        self._reach, self._unrest = pace.reach, 1.0
        self._wanders = np.diag(np.square([self._reach, self._reach, _SWELLS]))
        self._residual = ResidualResponse(pace.interval)
        self._before = self._shown = np.zeros((0, N_PARAMETERS))
        self._deficit = Deficit.none(len(model.solver.table.basis))
        self._expected = Expectation.none()
        self._rival: Rival | None = None
        self._jump = CommonModeJump()
        pattern = model.response.state.model.pattern
        self.watch = FrameWatch(pattern, self._policy)
        self._sight = Sight(model, self.watch.channels, noise, gain)
        law = StrainLaw(skin.gauge, skin.gauge_across, skin.layer)
        self.deforming = Deforming(model.strained, law, self._policy)
        self.view = DriveView(
            model, skin, CellDiscs.of(mesh), self._sight, self.watch, self._residual, self.deforming
        )
        self._wander = 0.0
        self._slow, self._beside = Stacked(), Stacked()

    def renewing(
        self, noise: FloatArray, gain: float = 1.0
    ) -> Generator[None, None, Callable[[], None]]:
        """Pieces of work towards other noise, or another gain; what they return goes on with it."""
        return (yield from self._sight.renewing(noise, gain, self.watch.excess))

    def preparing(self, other: SpotFinder) -> Generator[None, None, Callable[[], None]]:
        """Make ready for frames as those of an ``other`` finder of the same skin; what is returned
        goes on where that is: with its touches, and what stayed behind others."""
        adopt = yield from self._sight.following(other._sight, self.watch.excess)
        return partial(self._go_on, other, adopt)

    def _go_on(self, other: SpotFinder, adopt: Callable[[], None]) -> None:
        adopt()
        self._before, self._expected = other._before, other._expected
        self._residual, self._jump = other._residual, other._jump
        self.deforming.go_on(other.deforming)
        self.view = replace(self.view, residual=self._residual)
        self.watch.go_on(other.watch)

    def foresee(self, nuisance: FloatArray, jumps: FloatArray) -> None:
        """Make ready for frames with these; see :meth:`push`."""
        self._sight.look(nuisance, jumps)
        self._sight.of(self.watch.excess)

    @property
    def moved(self) -> FloatArray | None:
        """(n_meas,) of difference data that a deformation of the sheet has moved them by; None
        where it is at rest, or as it is after one."""
        if self.deforming.told is None:
            return None
        return np.asarray(self.deforming.moved * self._sight.scale)

    @property
    def jump(self) -> float | None:
        """What the common mode has jumped by, where it has, in deviations of :meth:`push`."""
        return self._jump.size if self._jump.jumped else None

    def push(
        self,
        dv: FloatArray,
        nuisance: FloatArray,
        jumps: FloatArray | None = None,
        wander: float = 0.0,
    ) -> list[Detection]:
        """Touches of ``dv`` (n_meas,), strongest first.

        ``nuisance`` (n_meas, k) spans the directions along which the data tell nothing of a
        touch: a unit vector for each excluded row. There must be more rows than that. Along each of
        ``jumps`` (n_meas, j) the data may have jumped, by so much as a standard deviation; along
        the first they have moved by ``wander`` deviations of that, one standard deviation.
        """
        self._sight.look(nuisance, np.zeros((len(dv), 0)) if jumps is None else jumps)
        self._wander = wander
        data = self._residual.without(dv / self._sight.scale)
        self.watch.begin(data, self._sight.of(self.watch.excess).gauge)
        found = self.deforming.decided(self._frame(data), partial(self._searched, data))
        detected, _, _, matched, _, state = found
        solver = self._model.solver
        times = self.watch.unexplained(solver, detected.fit, matched)
        if times > 1.0:  # it may be no touch in as much noise
            found = self._searched(data, state, times)
            detected, matched = found.detected, found.matched
        self.deforming.take(found)
        self._data = data - self.deforming.moved
        self._rival, self._jump = found.rival, found.jump
        self.watch.end(solver, detected.fit, matched, times)
        self._unrest = self._motion(detected.fit.spots)
        self._before, self._deficit = detected.fit.spots, detected.fit.deficit
        self._expected = self._going_on(detected)
        self._change = detected.fit.change + detected.fit.deficit.change
        return self._detections(joined(detected))

    def learn(self, *, touched: bool) -> None:
        """Whether something touches in the newest frame: its touches leave something behind, or
        what it holds of touches, others have left."""
        if not (self._policy.pace.speed and self._policy.pace.interval):
            return
        if touched:
            self._residual.after(self._shown, self._model.shapes)
        else:
            self._residual.idle(self._data)

    def others(self) -> FloatArray:
        """(k, n_meas) V of the model: for each touch of the newest frame what all others change."""
        whole = self._change @ self._model.solver.table.basis
        return np.asarray(whole - self._model.changes(self._shown))

    def _frame(self, data: FloatArray) -> FrameData:
        """A frame beside the touches of the last one."""
        return FrameData(data, self._sight.of(self.watch.excess).table, self._model, self._before)

    def _searched(
        self, data: FloatArray, state: StrainState | None, times: float = 1.0
    ) -> Searched:
        """What explains ``data`` (n_meas,) where the sheet is deformed as ``state`` says, in so
        many times the noise that is known: touches, and whether the common mode has jumped."""
        sight = self._sight.of(self.watch.excess)
        seen, matched, _, jumps = sight if times == 1.0 else sight.louder(times)
        whitened, rest = seen.whitened(data if state is None else data - state.moved)
        # what stays from frame to frame: residual responses, and how far the common mode has moved
        left = self._slow(self._residual.directions(seen.matrix), jumps.wandered(self._wander))
        exact = self._model.response.changes
        reduced: Reduced | None = self._model.reduced
        if state is not None:
            if state.shows_in_touches:
                exact, reduced = partial(self.deforming.touched, state), None
            left = self._beside(state.spread.seen(seen.matrix), left)
        problem = Problem(
            exact=exact,
            reduced=reduced,
            seen=seen,
            prior=self._model.prior,
            sign=self._policy.sign,
            reach=self._unrest * self._reach,
            grows=self._unrest * _GROWS,
            data=whitened,
            rest=rest,
            left=left,
            expected=self._expected,
        )
        explain = partial(self._explained, matched)
        (detected, rival), jump = self._jump.decided(problem, jumps, self._policy, explain)
        return Searched(detected, rival, jump, matched, problem, state)

    def _explained(self, matched: Matched, problem: Problem) -> Explained:
        """Touches of the frame of ``problem``, and one more that frames may speak for."""
        reach("touches")
        sign = self.watch.sign(problem, matched)
        if sign != problem.sign:
            problem = replace(problem, sign=sign)
        policy = self._policy
        selection = ForwardSelection(problem, matched, policy, self._deficit)
        detected = judged(selection, selection.explained(self._before))
        if policy.pace.joint and sign != policy.sign:  # presses may look like a rise between them
            own = replace(selection, problem=replace(problem, sign=policy.sign))
            pressed = judged(own, own.explained(self._before))
            if not decisions.favours(problem.gain(pressed.fit, detected.fit)):
                detected = pressed
        rival: Rival | None = None
        if self._reach and sign != "both" and len(detected.fit.spots):
            reach("one touch more")
            detected, rival = challenged(selection, detected, self._rival, self._going_on)
        if self.watch.puzzled(problem, detected.fit):
            reach("both signs")
            both = self._anew(selection, len(detected.fit.spots) + 1)
            rises = decisions.rises_beside(policy, detected.fit, both.fit, both.ratio)
            if rises and decisions.favours(problem.gain(detected.fit, both.fit)):
                detected = both
        show("hypotheses", partial(weighed, problem, detected, rival))
        return detected, rival

    def _anew(self, selection: ForwardSelection, most: int) -> SpotDetections:
        """Touches of both signs, ``most`` of them, as if there had been none in the last frame."""
        most = min(most, self._policy.most)
        policy = replace(self._policy, most=most, pace=replace(self._policy.pace, tries=most))
        none = Deficit.none(len(self._deficit.change))
        problem = replace(selection.problem, sign="both", expected=Expectation.none())
        anew = ForwardSelection(problem, selection.matched, policy, none)
        return judged(anew, anew.explained(np.zeros((0, N_PARAMETERS))))

    def _going_on(self, detected: SpotDetections) -> Expectation:
        """What is expected of the touches of this frame in the next one."""
        if not self._reach or not len(detected.fit.spots):
            return Expectation.none()
        return Expectation.of(detected.fit.spots, detected.covariance, self._wanders)

    def _motion(self, spots: FloatArray) -> float:
        """How much of what touches may do they have done since the frame before; 1 where there are
        more of them, or fewer, or frames say nothing of each other."""
        if len(spots) != len(self._before) or not len(spots) or not self._reach:
            return 1.0
        way = spots[:, :2] - self._before[:, :2]
        moved = max([math.sqrt(x * x + y * y) for x, y in way.tolist()])
        return min(1.0, math.hypot(_REST, moved / self._reach))

    def _detections(self, detected: SpotDetections) -> list[Detection]:
        """The touches as detections, strongest first."""
        self._shown = spots = detected.fit.spots
        if not len(spots):
            return []
        if self.deforming.hides_touches:
            self._shown = spots[:0]
            return []
        shown = np.flatnonzero(~self._policy.is_wrong(spots[:, CONTENT]))
        found = [self._detection(detected, k, spots[k].tolist()) for k in shown.tolist()]
        order = sorted(range(len(found)), key=lambda k: -abs(found[k].peak))
        self._shown = spots[shown[order]]
        return [found[k] for k in order]

    def _detection(self, detected: SpotDetections, k: int, spot: list[float]) -> Detection:
        x, y, log_radius, content = spot
        radius, ratio = math.exp(log_radius), float(detected.ratio[k])
        # a touch is told against the untouched skin
        content += self._residual.beneath(x, y, radius)
        own = slice(4 * k, 4 * k + 2)
        spread = detected.covariance[own, own] + self._rim.doubt(x, y, radius)
        (xx, xy), (_, yy) = (_ERRS * (spread - (1 - _LASTING) * detected.noise[own, own])).tolist()
        weak = decisions.is_weak(
            self._policy, ratio, float(detected.fresh[k]), float(detected.beside[k])
        )
        detection = self.view.shown(np.array([x, y, log_radius, content]), spread, ratio)
        close = bool(detected.close[k])
        return replace(detection, weak=weak, close=close, lasting=(xx, xy, yy))


def joined(detected: SpotDetections) -> SpotDetections:
    """The same with each two touches as one whose positions are not distinct."""
    places = detected.fit.spots[:, :2].tolist()
    variance = detected.covariance.diagonal().tolist()
    for i in range(len(places)):
        for j in range(i + 1, len(places)):
            x, y = (one - other for one, other in zip(places[i], places[j], strict=True))
            both = sum(variance[4 * k] + variance[4 * k + 1] for k in (i, j))
            if decisions.are_distinct(x * x + y * y, 2 * both):  # no direction has more than all
                continue
            away = np.array([x, y])
            pick = [4 * i, 4 * i + 1, 4 * j, 4 * j + 1]
            block = detected.covariance[np.ix_(pick, pick)]
            turn = np.concatenate([away, -away])
            if not decisions.are_distinct((away @ away) ** 2, turn @ block @ turn):
                return joined(_merged(detected, i, j))
    return detected


def _merged(detected: SpotDetections, i: int, j: int) -> SpotDetections:
    """Touches i and j as one, at the middle of their contents."""
    fit, keep = detected.fit, np.delete(np.arange(len(detected.fit.spots)), j)
    share = np.abs(fit.spots[[i, j], CONTENT])
    share = share / share.sum()
    one = fit.spots[i].copy()
    one[:2] = share @ fit.spots[[i, j], :2]
    one[LOG_RADIUS] = share @ fit.spots[[i, j], LOG_RADIUS]
    one[CONTENT] = fit.spots[[i, j], CONTENT].sum()
    spots = fit.spots.copy()
    spots[i] = one
    mix = np.eye(4 * len(fit.spots))
    for column, part in ((i, share[0]), (j, share[1])):
        mix[4 * i : 4 * i + 2, 4 * column : 4 * column + 2] = part * np.eye(2)
    rows = (4 * keep[:, None] + np.arange(N_PARAMETERS)).ravel()
    covariance, noise = (
        (mix @ each @ mix.T)[np.ix_(rows, rows)] for each in (detected.covariance, detected.noise)
    )
    ratio, fresh = detected.ratio.copy(), detected.fresh.copy()
    for each in (ratio, fresh):
        each[i] = np.hypot(*each[[i, j]])
    close, beside = detected.close.copy(), detected.beside.copy()
    close[i], beside[i] = True, min(beside[i], beside[j])
    kept = replace(fit, spots=spots[keep])
    counted = ratio[keep], fresh[keep], covariance, noise, close[keep], beside[keep]
    return SpotDetections(kept, *counted)
