"""What a choice of alpha rests on, and what it hands back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tomoskin.core import DataError, FloatArray

Locate = Callable[[FloatArray], FloatArray]
"""Image (n_cells,) → places (k, 2) of the touches in it, m."""


@dataclass(frozen=True, eq=False)
class Curve:
    """What a rule looked at: ``y`` over ``x``, and the index that it chose."""

    x: FloatArray
    y: FloatArray
    x_label: str
    y_label: str
    chosen: int


@dataclass(frozen=True, eq=False)
class AlphaChoice:
    """An alpha, the rule that chose it, why in a sentence, and the curve it was read from."""

    alpha: float
    rule: str
    reason: str
    curve: Curve | None = None


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is known beside the model; each rule says what it needs.

    Attributes
    ----------
    noise
        (n_meas,) standard deviation of one frame of difference data.
    frames
        (n, n_meas) difference data of a touched skin.
    places
        (n, 2) m, where each of the frames was touched.
    locate
        Finds the touches of an image.
    """

    noise: FloatArray | None = None
    frames: FloatArray | None = None
    places: FloatArray | None = None
    locate: Locate | None = None

    def known_noise(self, n_meas: int) -> FloatArray:
        """The noise, (n_meas,).

        Raises DataError when it is missing, not finite, zero everywhere or below zero.
        """
        if self.noise is None:
            raise DataError(
                "the noise is not known", hint="give idle frames, two at least, as the reference"
            )
        noise = np.asarray(self.noise, dtype=np.float64)
        if noise.shape != (n_meas,):
            raise DataError(f"expected noise of shape ({n_meas},), got {noise.shape}")
        _refuse_not_finite(noise, "noise")
        if not ((noise >= 0).all() and noise.any()):
            raise DataError(
                f"expected noise above 0, got {noise.min():g} to {noise.max():g}",
                hint="idle frames that are all the same tell no noise",
            )
        return noise

    def touched(self, n_meas: int) -> FloatArray:
        """The frames that are not zero throughout, (k, n_meas); a reference's own frame is.

        Raises DataError when there are none, or a value is not finite.
        """
        frames = self._checked(n_meas)
        return frames[frames.any(axis=1)]

    def _checked(self, n_meas: int) -> FloatArray:
        if self.frames is None or not len(self.frames):
            raise DataError(
                "there are no frames of a touched skin", hint="give a recording with touches"
            )
        if np.iscomplexobj(self.frames):
            raise DataError("expected real difference data, got complex")
        frames = np.asarray(self.frames, dtype=np.float64)
        if frames.ndim != 2 or frames.shape[1] != n_meas:
            raise DataError(f"expected frames of shape (n, {n_meas}), got {frames.shape}")
        _refuse_not_finite(frames, "difference data")
        if not frames.any():
            raise DataError("the difference data are all zero", hint="give frames with touches")
        return frames

    def labelled(self, n_meas: int) -> tuple[FloatArray, FloatArray]:
        """Frames with a known place, (k, n_meas) and (k, 2).

        Raises DataError when there are fewer than two.
        """
        frames = self._checked(n_meas)
        if self.places is None:
            raise DataError(
                "no frame says where the skin was touched", hint="give a recording with xy_m"
            )
        if self.places.shape != (len(frames), 2):
            raise DataError(f"expected places ({len(frames)}, 2), got {self.places.shape}")
        known = np.isfinite(self.places).all(axis=1) & frames.any(axis=1)
        if np.count_nonzero(known) < 2:
            raise DataError(
                f"expected two labelled presses at least, got {np.count_nonzero(known)}"
            )
        return frames[known], self.places[known]


def _refuse_not_finite(values: FloatArray, name: str) -> None:
    finite = np.isfinite(values)
    if not finite.all():
        place = np.argwhere(~finite)[0].tolist()
        raise DataError(
            f"expected finite numbers, got {values[tuple(place)]}",
            where=f"{name}, row {place[-1]}",
        )
