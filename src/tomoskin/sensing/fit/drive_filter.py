"""Touches that move, drive by drive: each measurement counts at its own time.

A touch is a position and a velocity, a radius and a content, and the two amplitudes that a fit
integrates over, of direction and shape. An extended Kalman filter (Jazwinski 1970) takes the
measurements of one drive after the other. So a scan does not tear what moves within it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.sensing.fit.drive_evidence import Onset
from tomoskin.sensing.fit.problem import Solver
from tomoskin.sensing.fit.solver import SheetDomain
from tomoskin.sensing.fit.spot import CONTENT, LOG_RADIUS, N_PARAMETERS, X, Y
from tomoskin.sensing.fit.spot_fit import SpotPrior
from tomoskin.sensing.track import RESIDUAL, TrackSettings, motion_step

_TRACK = TrackSettings()

_SWELLS, _GROWS = 0.1, 1.0
"""Standard deviations of the logarithm of the radius, and of the content in parts of it, by which
they wander in a second."""

_OTHERWISE = 0.15
"""Part by which each measurement answers otherwise than the model's, in each drive anew."""

_STEPS = 2
"""Steps of a drive: the response bends."""

_LAGS, _FLOOR = 0.06, 0.0025
"""What a sheet remembers of a touch that moves: seconds by which its response lies behind, and the
standard deviation that no touch goes below, m. Chosen on the textile discs, seed 9100."""

_LEFT = (RESIDUAL.part / 2) ** 2
"""Variance of the part of a touch that is left in the sheet once it has been lifted."""

_SPOT = [0, 1, 4, 5]
"""Of a state: the columns of a spot; 2 and 3 are its velocity, 6 and 7 direction and shape."""

_SIZE = 8


@dataclass(frozen=True, eq=False)
class MovingTouch:
    """The ``state`` (8,) of a touch at ``time`` s of the board, and its ``covariance`` (8, 8)."""

    time: float
    state: FloatArray
    covariance: FloatArray

    @classmethod
    def begin(
        cls, time: float, spot: FloatArray, covariance: FloatArray, prior: SpotPrior
    ) -> MovingTouch:
        """A touch at a ``spot`` (4,) whose position has a ``covariance`` (2, 2) m²: what else is
        known of it is the prior."""
        state, spread = np.zeros(_SIZE), np.zeros((_SIZE, _SIZE))
        state[_SPOT], spread[:2, :2] = spot, covariance
        state[4] = np.clip(state[4], *prior.log_radii)
        others = (_TRACK.speed, _TRACK.speed, prior.spread, spot[CONTENT], 1.0, 1.0)
        spread[range(2, _SIZE), range(2, _SIZE)] = np.square(others)
        return cls(time, state, spread)

    @classmethod
    def of_onset(cls, time: float, onset: Onset, prior: SpotPrior) -> MovingTouch:
        """A touch that has begun: nothing is known of its radius."""
        spot = np.array([*onset.middle, prior.middle[LOG_RADIUS], onset.spot[CONTENT]])
        return cls.begin(time, spot, onset.covariance, prior)

    @property
    def content(self) -> float:
        """The content of the touch, in m²."""
        return float(self.state[5])

    @property
    def spot(self) -> FloatArray:
        """(4,) the spot as the table of responses takes it."""
        return np.asarray(self.state[_SPOT])

    def at(self, time: float) -> MovingTouch:
        """The touch at a later ``time`` s."""
        seconds = max(time - self.time, 0.0)
        step, noise = _moving(round(seconds, 7))
        noise = noise.copy()
        noise[4, 4] = _SWELLS**2 * seconds
        noise[5, 5] = (_GROWS * self.state[5]) ** 2 * seconds
        return MovingTouch(time, step @ self.state, step @ self.covariance @ step.T + noise)

    def position(self) -> tuple[FloatArray, FloatArray]:
        """(2,) m and its covariance (2, 2) m², with what the sheet remembers of its way."""
        behind = _LAGS * self.state[2:4]
        memory = np.outer(behind, behind) + _FLOOR**2 * np.eye(2)
        return self.state[:2], self.covariance[:2, :2] + memory


def _cost(data: FloatArray, covariance: FloatArray) -> float:
    """Less the logarithm of the likelihood of normal ``data`` (m,), up to what all have."""
    square = float(data @ np.linalg.solve(covariance, data))
    return (square + float(np.linalg.slogdet(covariance)[1])) / 2


@lru_cache(maxsize=16)
def _moving(seconds: float) -> tuple[FloatArray, FloatArray]:
    """(8, 8) by which a state goes on, and the noise of position and velocity meanwhile: those of
    the tracker."""
    leads, remains, there, cross, moving = motion_step(seconds, _TRACK)
    step, noise = np.eye(_SIZE), np.zeros((_SIZE, _SIZE))
    for place, speed in ((0, 2), (1, 3)):
        step[place, speed], step[speed, speed] = leads, remains
        noise[place, place], noise[speed, speed] = there, moving
        noise[place, speed] = noise[speed, place] = cross
    return step, noise


@dataclass(frozen=True, eq=False)
class DriveFilter:
    """What takes the measurements of a drive.

    Attributes
    ----------
    solver
        Its table says what a spot does.
    prior, sign
        Of the touches.
    sheet
        Where they may be.
    noise
        (n_meas, n_meas) V² of the measurements.
    """

    solver: Solver
    prior: SpotPrior
    sign: str
    sheet: SheetDomain
    noise: FloatArray

    def changes(self, touch: MovingTouch, rows: slice) -> FloatArray:
        """(m,) V that a touch changes."""
        return self._response(touch.state, rows)[0]

    def pushed(
        self, touch: MovingTouch, rows: slice, data: FloatArray
    ) -> tuple[MovingTouch, float, float]:
        """The touch after the ``data`` (m,) V of a drive at its time; and the logarithms of how
        much likelier these are if it has been lifted before the drive, and if while it was read."""
        before, spread = touch.state, touch.covariance
        own, state = self.noise[rows, rows], before
        gone = going = 0.0
        for step in range(_STEPS):
            change, slopes = self._response(state, rows)
            both = slopes @ spread @ slopes.T + own + np.diag((_OTHERWISE * change) ** 2)
            off = data - change - slopes @ (before - state)
            if not step:
                stands, half = _cost(off, both), change / 2  # a measurement shows it, or none of it
                gone = stands - _cost(data, own + _LEFT * np.outer(change, change))
                going = stands - _cost(data - half, own + np.diag(half**2))
            gain = np.linalg.solve(both, slopes @ spread).T
            state = self._held(before + gain @ off)
        left = spread - gain @ both @ gain.T
        return MovingTouch(touch.time, state, (left + left.T) / 2), gone, going

    def _response(self, state: FloatArray, rows: slice) -> tuple[FloatArray, FloatArray]:
        """(m,) V of a state, and (m, 8) its slopes."""
        basis = self.solver.table.basis[:, rows]
        parts = self.solver.expanded(state[None, _SPOT])[0] @ basis
        change, own, unknown = parts[0], parts[1 : 1 + N_PARAMETERS], parts[1 + N_PARAMETERS :]
        unknown = unknown * np.array([[self.prior.directed], [self.prior.reshaped]])
        slopes = np.zeros((len(change), _SIZE))
        slopes[:, _SPOT] = own[[X, Y, LOG_RADIUS, CONTENT]].T
        slopes[:, 6:] = unknown.T
        return change + state[6:] @ unknown, slopes

    def _held(self, state: FloatArray) -> FloatArray:
        held = state.copy()
        held[_SPOT] = self.prior.held(self.sheet.held(state[None, _SPOT]), self.sign)[0]
        return held
