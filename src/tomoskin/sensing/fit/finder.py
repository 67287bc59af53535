"""Frames of difference data → detections, each fitted by its parameters."""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Generator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import is_
from typing import NamedTuple, Self

import numpy as np

from tomoskin.core import Detection, FloatArray, SkinError, finished, reach
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit.candidates import Candidates, Matched, footprints_of
from tomoskin.sensing.fit.cell_discs import CellDiscs
from tomoskin.sensing.fit.certificate import Certificate, Reduced
from tomoskin.sensing.fit.common_mode import CommonModeJump, Explained, Jumps
from tomoskin.sensing.fit.excess import Excess, Gauge
from tomoskin.sensing.fit.expectation import Expectation
from tomoskin.sensing.fit.native import NativeSolver
from tomoskin.sensing.fit.noise import ResidualDirections, ResidualResponse, Whitener
from tomoskin.sensing.fit.pace import EXHAUSTIVE, Pace
from tomoskin.sensing.fit.prior import SpotPrior
from tomoskin.sensing.fit.refine import Deficit, Problem, Solver, WhitenedTable
from tomoskin.sensing.fit.rival import Rival, challenged
from tomoskin.sensing.fit.search import SpotDetections, joined, search
from tomoskin.sensing.fit.selection import ForwardSelection
from tomoskin.sensing.fit.sheet import fields_of, fitting_sheet
from tomoskin.sensing.fit.solver import NumpySolver, SheetDomain
from tomoskin.sensing.fit.spot import FILLING, N_PARAMETERS, Footprints, Response
from tomoskin.sensing.fit.table import ResponseTable
from tomoskin.sensing.fit.tabulate import Tabulation, kept_tabulation
from tomoskin.sensing.fit.watch import FrameWatch

_CELLS = 1500
"""Of the mesh that spots are fitted on: their profile is smooth, and a frame is quick."""

_MOST = 5
"""Touches at once: more have more parameters than 8 or 16 electrodes tell apart."""

_GROWS = 0.5
"""Standard deviation of what a touch that has just begun grows by within a scan, in parts of it."""

_REST = 0.5
"""A touch that stood still in the frame before moves, and grows, by this part of that at least."""

_SWELLS = 0.08
"""Standard deviation of the logarithm of a touch's radius from frame to frame."""

_MASKS = 8
"""Nuisance subspaces whose whitening is kept."""


class Seen(NamedTuple):
    """How frames of one noise are seen: the table, candidates, channels and jumps."""

    table: WhitenedTable
    matched: Matched
    gauge: Gauge
    jumps: Jumps

    def louder(self, times: float) -> Seen:
        """The same in so many times the noise's variance."""
        if times == 1.0:
            return self
        table, matched = self.table.louder(times), self.matched.louder(times)
        return Seen(table, matched, self.gauge, self.jumps.louder(times))


@dataclass(frozen=True, eq=False)
class Adapted:
    """What an even sheet's model became for an uneven one.

    Attributes
    ----------
    table, certificate, candidates
        See :class:`ResponseTable`, :class:`Certificate` and :class:`Candidates`.
    """

    table: ResponseTable
    certificate: Certificate
    candidates: Candidates


@dataclass(frozen=True, eq=False)
class SpotModel:
    """What is made once for a skin and pattern; a table only where touches are fitted on it.

    Attributes
    ----------
    response
        The forward model with spots on it.
    prior
        What is likely of a spot.
    sign
        Of the touches, as in a skin's ``[touch]``.
    scale
        (n_meas,) 1/V by which the model's changes become difference data; ones where these are
        in volts.
    adapted
        Of an uneven sheet; None: what there is is made for this one.
    even
        The model that an uneven sheet's began from; None where this is it.
    """

    response: Response
    prior: SpotPrior
    sign: str
    scale: FloatArray
    adapted: Adapted | None = None
    even: SpotModel | None = None

    @classmethod
    def of(cls, skin: Skin, model: ForwardModel) -> Self:
        """For ``skin`` with the pattern of ``model``, on a mesh of its own.

        Raises
        ------
        ModelError
            When the mesh has no flat coordinates.
        """
        own = ForwardModel(_mesh(skin), model.pattern, model.contact_impedance, model.current)
        normalised = skin.inverse.difference == "normalised"
        response, n_meas = Response(own.at(skin.conductivity)), own.pattern.n_meas
        scale = 1 / np.abs(response.reference) if normalised else np.ones(n_meas)
        return cls(response, SpotPrior.of(own.mesh), skin.touch.sign, scale)

    @cached_property
    def tabulation(self) -> Tabulation:
        """What one spot does, tabulated: seconds of work, unless it is on disk."""
        return kept_tabulation(self.response, self.prior, self.sign)

    @cached_property
    def candidates(self) -> Candidates:
        """Where touches are looked for."""
        if self.adapted is not None:
            return self.adapted.candidates
        return Candidates.of(self.response, self.prior)

    @cached_property
    def _feet(self) -> tuple[Footprints, ...]:
        """Of the candidates, for uneven sheets."""
        return footprints_of(self.response, self.prior)

    @cached_property
    def solver(self) -> Solver:
        """What fits spots by a table of what one does."""
        made = self.tabulation if self.adapted is None else self.adapted
        return _solver(self.response, made.table, self.prior)

    @cached_property
    def reduced(self) -> Reduced:
        """What stands for the exact model on this sheet."""
        made = self.tabulation if self.adapted is None else self.adapted
        return Reduced.of(self.response, made.certificate, self.prior)

    def warm_up(self) -> None:
        """Do what takes seconds the first time, and half a second later on, before frames come."""
        _ = self.tabulation.lattices, self.candidates, self._feet, self.solver, self.reduced
        _ = fields_of(self.response.spots.mesh)

    def changes(self, spots: FloatArray) -> FloatArray:
        """(k, n_meas) V that each of ``spots`` (k, 4) alone adds to the reference, by the table."""
        return np.asarray(self.solver.expanded(spots)[:, 0] @ self.solver.table.basis)

    def fitted_to(self, reference: FloatArray, deviation: FloatArray | float = 0.0) -> SpotModel:
        """As :meth:`fitting`, at once."""
        return finished(self.fitting(reference, deviation))

    def fitting(
        self, reference: FloatArray, deviation: FloatArray | float = 0.0
    ) -> Generator[None, None, SpotModel]:
        """The model of the sheet that a ``reference`` (n_meas,) V shows, a piece between yields.

        Itself where that sheet is even. ``deviation`` (n_meas,) V is the reference's own; see
        :mod:`tomoskin.sensing.fit.sheet`.
        """
        state = yield from fitting_sheet(self.response.state, reference, deviation)
        if state is self.response.state:
            return self
        response = Response(state)
        table = yield from self.tabulation.adapted(response)
        certificate = yield from self.tabulation.certificate.adapted(response, table)
        candidates = yield from self.candidates.adapted(self.response, response, self._feet)
        scale = self.scale
        if (scale != 1.0).any():
            scale = 1 / np.abs(response.reference)
        adapted = Adapted(table, certificate, candidates)
        made = replace(self, response=response, scale=scale, adapted=adapted, even=self)
        yield
        made.__dict__["reduced"] = yield from Reduced.making(response, certificate, self.prior)
        yield
        _ = made.solver
        table.__dict__["typical"] = yield from table.typifying()
        return made


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
    scan_time
        That a scan takes, s: in it touches move and grow. 0 where rows are read all at once.
    interval
        Between two frames, s: how many of them a residual response lasts.
    pace
        How much is tried in a frame.

    Attributes
    ----------
    watch
        What touches do not explain.
    """

    def __init__(
        self,
        model: SpotModel,
        skin: Skin,
        mesh: Mesh,
        noise: FloatArray,
        gain: float = 1.0,
        *,
        scan_time: float = 0.0,
        interval: float = 0.0,
        pace: Pace = EXHAUSTIVE,
    ) -> None:
        self._model, self._settings = model, skin.touch
        self._cells = CellDiscs.of(mesh)
        self._pace, self._reach, self._unrest = pace, pace.speed * scan_time, 1.0
        self._fading = math.ceil(pace.fading / interval) if interval else 0
        self._residual = ResidualResponse.none()
        self._left = ResidualDirections.none()
        self._unit = skin.conductivity
        self._most = min(skin.touch.max_touches, _MOST)
        self._before = self._shown = np.zeros((0, N_PARAMETERS))
        self._deficit = Deficit.none(len(model.solver.table.basis))
        self._change = self._deficit.change
        self._expected = Expectation.none()
        self._rival: Rival | None = None
        self._jump = CommonModeJump()
        pattern = model.response.state.model.pattern
        self.watch = FrameWatch(pattern, skin.touch.sign, skin.touch.snr)
        self._scale = model.scale * gain
        self._noise = noise / self._scale[:, None] / self._scale
        self._nuisance = self._jumps = np.zeros((len(noise), 0))
        self._matched: OrderedDict[bytes, Seen] = OrderedDict()
        self._wander = 0.0
        self._newest_slow: tuple[tuple[FloatArray, ...], FloatArray] | None = None
        self._newest_seen: tuple[tuple[object, ...], Seen] | None = None

    def renewing(self, noise: FloatArray, gain: float = 1.0) -> Generator[None, None, None]:
        """Go on with other noise, or another gain, at the end of some pieces of work."""
        scale = self._model.scale * gain
        yield from self._renewed(noise / scale[:, None] / scale, scale)

    def preparing(self, other: SpotFinder) -> Generator[None, None, None]:
        """Make ready for frames as those of an ``other`` finder of the same skin, and go on where
        that is: with its touches, and what stayed behind others."""
        self._nuisance, self._jumps = other._nuisance, other._jumps
        yield from self._renewed(self._noise, self._scale)
        self._before, self._expected = other._before, other._expected
        self._residual, self._jump = other._residual, other._jump
        self.watch.go_on(other.watch)

    def _renewed(self, noise: FloatArray, scale: FloatArray) -> Generator[None, None, None]:
        scaled = self._nuisance / scale[:, None], self._jumps / scale[:, None]
        made = yield from self._making(noise, *scaled)
        self._scale, self._noise = scale, noise
        self._matched = OrderedDict({_key(scaled, self.watch.excess): made})

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
        self._nuisance = nuisance
        self._jumps = np.zeros((len(dv), 0)) if jumps is None else jumps
        self._wander = wander
        data = dv / self._scale
        self.watch.begin(data, self._seen().gauge)
        (detected, rival), jump, matched = self._searched(data)
        solver = self._model.solver
        times = self.watch.unexplained(solver, detected.fit, matched)
        if times > 1.0:  # it may be no touch in as much noise
            (detected, rival), jump, matched = self._searched(data, times)
        self._rival, self._jump = rival, jump
        self.watch.end(solver, detected.fit, matched, times)
        self._unrest = self._motion(detected.fit.spots)
        self._before, self._deficit = detected.fit.spots, detected.fit.deficit
        self._expected = self._going_on(detected)
        if self._fading:
            self._residual = self._residual.after(self._before, self._model.changes, self._fading)
        self._change = detected.fit.change + detected.fit.deficit.change
        return self._detections(joined(detected))

    def others(self) -> FloatArray:
        """(k, n_meas) V of the model: for each touch of the newest frame what all others change."""
        whole = self._change @ self._model.solver.table.basis
        return np.asarray(whole - self._model.changes(self._shown))

    def _searched(
        self, data: FloatArray, times: float = 1.0
    ) -> tuple[Explained, CommonModeJump, Matched]:
        """Touches of ``data`` (n_meas,) in so many times the noise that is known; and whether the
        common mode has jumped."""
        seen, matched, _, jumps = self._seen().louder(times)
        whitened, rest = seen.whitened(data)
        self._left = self._left.of(seen.matrix, self._residual.changes)
        problem = Problem(
            response=self._model.response,
            reduced=self._model.reduced,
            seen=seen,
            prior=self._model.prior,
            sign=self._settings.sign,
            reach=self._unrest * self._reach,
            grows=self._unrest * _GROWS,
            data=whitened,
            rest=rest,
            left=self._slow(jumps),
            expected=self._expected,
        )
        explain = partial(self._explained, matched)
        return *self._jump.decided(problem, jumps, self._settings.snr, explain), matched

    def _slow(self, jumps: Jumps) -> FloatArray:
        """(k, c) what stays from frame to frame and is no touch: residual responses, and how far
        the common mode has wandered."""
        now = self._left.rows, jumps.wandered(self._wander)
        newest = self._newest_slow
        if newest is None or not all(map(is_, now, newest[0])):
            newest = self._newest_slow = now, np.concatenate(now)
        return newest[1]

    def _explained(self, matched: Matched, problem: Problem) -> Explained:
        """Touches of the frame of ``problem``, and one more that frames may speak for."""
        reach("touches")
        sign = self.watch.sign(problem, matched)
        if sign != problem.sign:
            problem = replace(problem, sign=sign)
        least, pace = self._settings.snr, self._pace
        selection = ForwardSelection(problem, matched, least, self._most, pace, self._deficit)
        detected = search(selection, self._before)
        if pace.joint and sign != self._settings.sign:  # presses may look like a rise between them
            own = replace(selection, problem=replace(problem, sign=self._settings.sign))
            pressed = search(own, self._before)
            if not problem.favours(detected.fit, pressed.fit):
                detected = pressed
        rival: Rival | None = None
        if self._reach and sign != "both":
            reach("one touch more")
            detected, rival = challenged(selection, detected, self._rival, self._going_on)
        if self.watch.puzzled(problem, detected.fit):
            reach("both signs")
            both = self._anew(selection, len(detected.fit.spots) + 1)
            if self.watch.turns(both, detected.fit) and problem.favours(both.fit, detected.fit):
                detected = both
        return detected, rival

    def _anew(self, selection: ForwardSelection, most: int) -> SpotDetections:
        """Touches of both signs, ``most`` of them, as if there had been none in the last frame."""
        most = min(most, self._most)
        pace = replace(self._pace, tries=most)
        none = Deficit.none(len(self._deficit.change))
        problem = replace(selection.problem, sign="both", expected=Expectation.none())
        return search(
            ForwardSelection(problem, selection.matched, selection.least, most, pace, none),
            np.zeros((0, N_PARAMETERS)),
        )

    def _going_on(self, detected: SpotDetections) -> Expectation:
        """What is expected of the touches of this frame in the next one."""
        if not self._reach or not len(detected.fit.spots):
            return Expectation.none()
        wander = self._reach, self._reach, _SWELLS
        return Expectation.of(detected.fit.spots, detected.covariance, wander)

    def _motion(self, spots: FloatArray) -> float:
        """How much of what touches may do they have done since the frame before; 1 where there are
        more of them, or fewer, or frames say nothing of each other."""
        if len(spots) != len(self._before) or not len(spots) or not self._reach:
            return 1.0
        way = spots[:, :2] - self._before[:, :2]
        moved = max([math.sqrt(x * x + y * y) for x, y in way.tolist()])
        return min(1.0, math.hypot(_REST, moved / self._reach))

    def _seen(self) -> Seen:
        """How the newest frame is seen: as the one before, where nothing has changed."""
        now, newest = (
            (self._nuisance, self._jumps, self._noise, self.watch.excess),
            self._newest_seen,
        )
        if newest is None or not all(map(is_, now, newest[0])):
            newest = self._newest_seen = now, self._kept()
        return newest[1]

    def _kept(self) -> Seen:
        scaled = self._nuisance / self._scale[:, None], self._jumps / self._scale[:, None]
        key = _key(scaled, self.watch.excess)
        if key not in self._matched:
            self._matched[key] = finished(self._making(self._noise, *scaled))
            if len(self._matched) > _MASKS:
                self._matched.popitem(last=False)
        self._matched.move_to_end(key)
        return self._matched[key]

    def _making(
        self, noise: FloatArray, nuisance: FloatArray, jumps: FloatArray
    ) -> Generator[None, None, Seen]:
        """What frames of this noise, nuisance subspace and jumps are seen by."""
        model, channels = self._model, self.watch.channels
        noise = self.watch.excess.added(noise, channels)
        white = Whitener.of(noise)
        yield
        white = white.without(nuisance)
        yield
        seen = yield from WhitenedTable.making(model.solver, white, model.response.times, jumps)
        yield
        gauge = yield from Gauge.making(channels, noise, np.hstack([nuisance, jumps]))
        yield
        matched, _ = model.candidates.matched(seen), seen.kept
        rows = (seen.matrix @ jumps).T
        return Seen(seen, matched, gauge, Jumps(rows, np.zeros((0, rows.shape[1]))))

    def _detections(self, detected: SpotDetections) -> list[Detection]:
        """Strongest first."""
        spots = detected.fit.spots
        shown = np.flatnonzero(~self.watch.wrong(spots))
        found = [self._detection(detected, k, spots[k].tolist()) for k in shown.tolist()]
        order = sorted(range(len(found)), key=lambda k: -abs(found[k].peak))
        self._shown = spots[shown[order]]
        return [found[k] for k in order]

    def _detection(self, detected: SpotDetections, k: int, spot: list[float]) -> Detection:
        x, y, log_radius, content = spot
        (xx, xy), (_, yy) = detected.covariance[4 * k : 4 * k + 2, 4 * k : 4 * k + 2].tolist()
        radius = math.exp(log_radius)
        return Detection(
            x=x,
            y=y,
            sd_x=math.sqrt(xx),
            sd_y=math.sqrt(yy),
            area=math.pi * radius**2,
            peak=self._unit * math.expm1(content / (FILLING * radius**2)),
            cells=self._cells.within(x, y, radius),
            cov_xy=xy,
            snr=float(detected.ratio[k]),
            weak=bool(detected.fresh[k] < self._settings.snr),
            close=bool(detected.close[k]),
        )


def _key(directions: tuple[FloatArray, ...], excess: Excess) -> bytes:
    return b"".join(part.tobytes() for part in directions) + excess.key


def _solver(response: Response, table: ResponseTable, prior: SpotPrior) -> Solver:
    """Of the native engine where that runs."""
    sheet = SheetDomain(response.spots.mesh)
    core = response.state.model.engine.core
    if core is None:
        return NumpySolver(table, sheet, prior)
    return NativeSolver(core, table, sheet, prior)


def _mesh(skin: Skin) -> Mesh:
    """Of its own; the skin's where so few cells do not resolve the electrodes."""
    try:
        return skin.altered({"mesh": {"cells": _CELLS}}).mesh()
    except SkinError:
        return skin.mesh()
