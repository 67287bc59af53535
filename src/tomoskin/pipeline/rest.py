"""The untouched skin: frames become its reference, the first state of the pipeline; and what that
says of the operator's alpha and of the sheet, in small steps."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, ModelError, Voltages
from tomoskin.imaging import AlphaChoice, Spectrum, choose
from tomoskin.pipeline.frame_result import NO_AGREEMENT, ModelAgreement
from tomoskin.pipeline.prepare import Prepared
from tomoskin.sensing.signal import Reference

_MOST_EXCLUDED, _MOST_LOST = 0.5, 0.25
"""A frame is lost of which more than the first part is excluded, and the others make a reference if
no more than the second part of them is."""


@dataclass(frozen=True, slots=True, eq=False)
class Rest:
    """The untouched skin, as it was collected.

    Attributes
    ----------
    reference
        Mean and noise of its voltages.
    without_reference
        (n_meas,) bool: measurements that have none.
    interval
        Between its frames, s; NaN where there was a single one.
    host_time
        Of the last of them, s.
    agreement
        Of the reference with the model.
    """

    reference: Reference
    without_reference: NDArray[np.bool_]
    interval: float
    host_time: float = 0.0
    agreement: ModelAgreement = NO_AGREEMENT


class Collecting:
    """Takes frames until there are enough for a reference with its noise.

    A measurement that was excluded in any of them, or that read exactly zero in all, has no
    reference: it takes the model's value, so that nothing downstream meets a NaN or divides by
    zero. A few frames of which most is excluded do not count at all.

    Parameters
    ----------
    needed
        Frames that make a reference.
    model
        (n_meas,) V, what the model expects of the untouched skin.
    least
        V below which no measurement's noise is: a converter that does not flicker rounds all the
        same.
    """

    def __init__(self, needed: int, model: FloatArray, least: FloatArray | float = 0.0) -> None:
        self._values = np.empty((needed, len(model)))
        self._times = np.empty(needed)
        self._model, self._least = model, least
        self._excluded = np.zeros(self._values.shape, dtype=bool)
        self.taken = 0

    def push(self, measured: Voltages) -> Rest | None:
        """Take one frame; the untouched skin once there are enough."""
        self._values[self.taken] = np.where(measured.excluded, self._model, measured.values)
        self._times[self.taken] = measured.time
        self._excluded[self.taken] = measured.excluded
        self.taken += 1
        if self.taken < len(self._values):
            return None
        lost = self._excluded.mean(axis=1) > _MOST_EXCLUDED
        counts = ~lost if lost.mean() <= _MOST_LOST else np.ones_like(lost)
        values = self._values[counts]
        excluded = self._excluded[counts].any(axis=0) | ~values.any(axis=0)
        values[:, excluded] = self._model[excluded]
        reference = Reference.of(values, self._least)
        interval = float(np.median(np.diff(self._times))) if self.taken > 1 else np.nan
        agreement = ModelAgreement.of(reference.mean[~excluded], self._model[~excluded])
        return Rest(reference, excluded, interval, measured.host_time, agreement)


_SAME = 0.05
"""An alpha that differs by less than this part is left as it is: the picture is the same."""

_STEP = 2e7
"""Multiplications of one step: about a millisecond on one core."""


Mask = NDArray[np.bool_]
"""(n_meas,) of measurements."""


Steps = Generator[Prepared | None, None, None]
"""Pieces of work; each yields the skin where it is prepared better from now on, or None."""


def tune(prepared: Prepared, reference: Reference, excluded: Mask | None = None) -> Steps:
    """The skin prepared for ``reference``.

    ``alpha = "auto"`` follows its noise, then touches are fitted on the sheet that it shows, which
    does not rest on measurements that are ``excluded``.
    """
    for better in _tune_image(prepared, reference):
        prepared = better or prepared
        yield better
    yield from _tune_sheet(prepared, reference, excluded)


def tuned(prepared: Prepared, reference: Reference) -> Prepared:
    """As :func:`tune`, at once; ``prepared`` itself where nothing changes."""
    return _last(prepared, tune(prepared, reference))


def tuned_image(prepared: Prepared, reference: Reference) -> Prepared:
    """As :func:`tuned`, the sheet left out."""
    return _last(prepared, _tune_image(prepared, reference))


def tuned_sheet(prepared: Prepared, reference: Reference, excluded: Mask | None = None) -> Prepared:
    """As :func:`tuned`, the alpha left out."""
    return _last(prepared, _tune_sheet(prepared, reference, excluded))


def _last(prepared: Prepared, steps: Steps) -> Prepared:
    for better in steps:
        prepared = better or prepared
    return prepared


def _tune_image(prepared: Prepared, reference: Reference) -> Steps:
    """The alpha stays where it was set by hand, where the noise is not known or not above zero,
    or where it would hardly change."""
    if prepared.light_touch is None or not reference.noise_is_known or not reference.noise.any():
        return
    noise = prepared.difference_noise(reference)
    choice = prepared.light_touch(noise)
    if abs(np.log(choice.alpha / prepared.choice.alpha)) < _SAME:
        return
    yield None
    spectrum = prepared.light_touch.spectrum
    rows = max(int(_STEP / len(noise) ** 2), 1)
    operator = yield from spectrum.operator_in_pieces(choice.alpha, rows)
    reason = f"{choice.reason}, measured on {reference.n_frames} idle frames"
    yield prepared.with_alpha(replace(choice, reason=reason), spectrum, operator)


def _tune_sheet(prepared: Prepared, reference: Reference, excluded: Mask | None) -> Steps:
    """The sheet stays where nothing is fitted on it, or it has been fitted before."""
    spots = prepared.spots
    if spots is None or spots.even is not None:
        return
    deviation = np.nan_to_num(reference.noise) / np.sqrt(reference.n_frames)
    mean = reference.mean if excluded is None else np.where(excluded, np.nan, reference.mean)
    fitted = yield from spots.fitting(mean, deviation)
    if fitted is not spots:
        yield replace(prepared, spots=fitted)


def tuned_by_rule(prepared: Prepared, rule: str, noise: FloatArray | None) -> Prepared:
    """The skin prepared anew with the alpha of the named rule.

    Raises
    ------
    ModelError
        When the rule is not known or finds no alpha, or the method has none.
    DataError
        When the rule needs the noise of difference data, and it is not known.
    """
    if prepared.skin.inverse.method != "one-step":
        raise ModelError(
            'a rule can choose alpha only for method "one-step", but the skin\'s method is '
            f'"{prepared.skin.inverse.method}"',
            where=prepared.skin.name,
            hint="leave out the rule, or change the method in the skin's [inverse]",
        )
    return with_choice(prepared, choose(Spectrum.of(prepared.problem), rule, noise))


def with_choice(prepared: Prepared, choice: AlphaChoice) -> Prepared:
    """The skin with that alpha, which no noise changes any more."""
    spectrum = Spectrum.of(prepared.problem)
    found = prepared.with_alpha(choice, spectrum, spectrum.operator(choice.alpha))
    return replace(found, light_touch=None)
