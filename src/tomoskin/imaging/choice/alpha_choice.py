"""What a choice of alpha rests on, what it hands back, and the searches that criteria share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from tomoskin.core import DataError, FloatArray, ModelError
from tomoskin.imaging.linear.spectrum import Spectrum

Locate = Callable[[FloatArray], FloatArray]
"""Image (n_cells,) → positions (k, 2) of the touches in it, m."""

Quantity = Callable[[float], float]
"""Something of alpha."""

_STRIDE = 8
"""A crossing is looked for between one in so many alphas of the fine grid."""


@dataclass(frozen=True, eq=False)
class Curve:
    """What a criterion looked at: ``y`` over ``x``, and the index that it chose."""

    x: FloatArray
    y: FloatArray
    x_label: str
    y_label: str
    chosen: int


@dataclass(frozen=True, eq=False)
class AlphaChoice:
    """An alpha, the criterion (``rule``) that chose it, the reason, and the curve it is from."""

    alpha: float
    rule: str
    reason: str
    curve: Curve | None = None


@dataclass(frozen=True, eq=False)
class Evidence:
    """What there is beside the model; each criterion says what it needs.

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
                "the noise of the measurements is missing",
                hint="give two or more idle frames as the reference",
            )
        noise = np.asarray(self.noise, dtype=np.float64)
        if noise.shape != (n_meas,):
            raise DataError(f"expected noise of shape ({n_meas},), got {noise.shape}")
        _refuse_not_finite(noise, "noise")
        if not ((noise >= 0).all() and noise.any()):
            raise DataError(
                f"expected noise above 0, got {noise.min():g} to {noise.max():g}",
                hint="the idle frames are all the same, so they show no noise: record new ones",
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
                "there is no frame of a touched skin", hint="give a recording with touches"
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
        """Frames with a label, (k, n_meas), and their positions (k, 2).

        Raises DataError when there are fewer than two.
        """
        frames = self._checked(n_meas)
        if self.places is None:
            raise DataError(
                "no frame has a label that says where the skin was touched",
                hint="give a recording with the array xy_m",
            )
        if self.places.shape != (len(frames), 2):
            raise DataError(
                f"expected positions of shape ({len(frames)}, 2), got {self.places.shape}"
            )
        labelled = np.isfinite(self.places).all(axis=1) & frames.any(axis=1)
        if np.count_nonzero(labelled) < 2:
            raise DataError(
                f"expected at least two labelled presses, got {np.count_nonzero(labelled)}"
            )
        return frames[labelled], self.places[labelled]


def _refuse_not_finite(values: FloatArray, name: str) -> None:
    finite = np.isfinite(values)
    if not finite.all():
        index = np.argwhere(~finite)[0].tolist()
        raise DataError(
            f"expected finite numbers, got {values[tuple(index)]}",
            where=f"{name}, row {index[-1]}",
        )


def crossing(
    spectrum: Spectrum,
    quantity: Quantity,
    level: float,
    *,
    rising: bool,
    rule: str,
    reason: str,
    label: str,
    hints: tuple[str, str],
) -> AlphaChoice:
    """The largest alpha at which ``quantity``, called ``label``, comes to ``level``.

    It must come there ``rising`` as alpha grows, or falling. Where it turns back further on, and so
    has the level once more, is no answer. Raises ModelError where it never does, with one of the
    ``hints``: what to do where it is too large throughout, and where too small.
    """
    alphas = spectrum.alphas[::_STRIDE]
    values = np.array([quantity(float(a)) for a in alphas])
    above = values > level
    steps = np.diff(above.astype(int))
    crossed = np.flatnonzero(steps == (1 if rising else -1))
    if not len(crossed):
        where, hint = ("above", hints[0]) if above[0] else ("below", hints[1])
        raise ModelError(
            f"{label} {'starts' if steps.any() else 'stays'} {where} {level:g}: "
            f"{values.min():.3g} to {values.max():.3g}",
            where=f"rule {rule}",
            hint=hint,
        )
    at = int(crossed[-1])
    low, high = (float(a) for a in alphas[[at, at + 1]])
    root = float(brentq(lambda a: quantity(a) - level, low, high, xtol=1e-12 * low))
    nearest = int(np.abs(np.log(alphas / root)).argmin())
    return AlphaChoice(root, rule, reason, Curve(alphas, values, "alpha", label, nearest))
