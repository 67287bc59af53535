"""The untouched skin: frames become its reference, the first state of the pipeline; and what that
says of the operator's alpha and of the sheet, in small steps, also where a body moves it."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray, ModelError, Voltages
from tomoskin.imaging import AlphaChoice, Spectrum, choose, for_recording
from tomoskin.pipeline.frame_result import NO_AGREEMENT, ModelAgreement
from tomoskin.pipeline.prepare import Prepared, image_method
from tomoskin.sensing.fit import SpotModel
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
    chosen = prepared.with_alpha(choice, spectrum, spectrum.operator(choice.alpha))
    return replace(chosen, light_touch=None)


_COMMON = 10.0
"""All voltages waver in common where their sum's variance is so many times that of noise."""


def tuned_by_file(prepared: Prepared, reference: Reference | None, frames: FloatArray) -> Prepared:
    """The skin prepared for a recording of another board than its own.

    What the skin's read-out predicts holds nothing there: alpha "auto" is chosen by the noise of
    the recording's idle frames, its ``frames`` (n, n_meas) of differences and what models get wrong
    (:func:`for_recording`); the noise of a trained operator is weighed by the last alone. Of
    normalised differences, those that divide by less than the model expects weigh less. What was
    set by hand stays. Where no idle frames show that all voltages waver in common, changes in
    common show in the image, but for calibrations, which were learnt without them.
    """
    if not _wavers_in_common(reference) and not prepared.calibrations:
        kept = prepared.skin.altered({"signal": {"common_modes": "kept"}})
        prepared = replace(prepared, skin=kept)
    inverse = prepared.skin.inverse
    if (method := image_method(prepared.skin)) is not None:
        made = method.for_recording(prepared.operator, _weights(prepared, reference))
        if made is None:
            return prepared
        return replace(prepared, choice=made[0], operator=made[1])
    if prepared.light_touch is None:
        return prepared
    problem = prepared.problem.weighed(inverse.record("prior"), _weights(prepared, reference))
    noise = None
    if reference is not None and reference.noise_is_known:
        noise = prepared.difference_noise(reference)
    choice = for_recording(Spectrum.of(problem), noise, frames)
    return with_choice(replace(prepared, problem=problem), choice)


def _wavers_in_common(reference: Reference | None) -> bool:
    """Whether the size of idle frames varies by more than the noise of each measurement does it."""
    if reference is None or reference.scatter is None:
        return False
    mean, scatter = reference.mean, reference.scatter.matrix
    return bool(mean @ scatter @ mean > _COMMON * (np.diag(scatter) @ mean**2))


def _weights(prepared: Prepared, reference: Reference | None) -> FloatArray:
    """(n_meas,) of the difference data."""
    problem = prepared.problem
    if problem.difference == "plain" or reference is None:
        return problem.weights
    model, mean = np.abs(problem.reference), np.abs(reference.mean)
    measured = mean * (model @ mean / (mean @ mean))
    return np.asarray(np.minimum(model, np.maximum(measured, 1e-6 * model.max())) ** 2)


_APART = 0.06
"""A sheet serves where the voltages are off from its own by this part of the reference at most."""

_MOST = 24
"""Sheets that are kept."""

_NEARER = 0.8
"""Another sheet is taken where it is nearer by this factor."""


class BodySheets:
    """Sheets that were fitted for some poses, each with what the body ``moved`` then: touches are
    fitted on the one that is nearest to how it stands.

    A sheet that is bent or stretched conducts otherwise along than across, and a touch on it
    changes other voltages than on the sheet at rest: by the model of that, one touch looks like
    several.

    Parameters
    ----------
    rest
        The model of the sheet at rest.
    reference
        What that reads.
    poses
        (p, n_meas) V that the body moved while it was learnt: the farthest from all that are kept
        is fitted when there is nothing else to do.
    """

    def __init__(self, rest: SpotModel, reference: Reference, poses: FloatArray) -> None:
        self.rest, self._reference, self._poses = rest, reference, poses
        self._apart = _APART * float(np.linalg.norm(reference.mean))
        self._kept: list[tuple[FloatArray, SpotModel]] = [(np.zeros_like(reference.mean), rest)]
        self._away = np.linalg.norm(poses, axis=1)
        self._now = 0

    def shifted(self, reference: Reference) -> Reference:
        """A ``reference`` at rest as it is where the sheet of the moment was fitted."""
        return replace(reference, mean=reference.mean + self._kept[self._now][0])

    def steps(self, prepared: Prepared, moved: FloatArray) -> Steps | None:
        """Pieces of work that lead to a better sheet for a body that has ``moved`` the voltages by
        so much, (n_meas,) V, or to one that will serve later; None where there is none."""
        away = [float(np.linalg.norm(moved - own)) for own, _ in self._kept]
        nearest, farthest = int(np.argmin(away)), int(np.argmax(self._away))
        if away[nearest] < _NEARER * away[self._now]:
            return self._taken(prepared, nearest)
        if len(self._kept) > _MOST:
            return None
        if away[nearest] > self._apart:
            return self._fitted(moved)
        return self._fitted(self._poses[farthest]) if self._away[farthest] > self._apart else None

    def _fitted(self, moved: FloatArray) -> Steps:
        even, deviation = self.rest.even or self.rest, np.nan_to_num(self._reference.noise)
        sheet = yield from even.fitting(self._reference.mean + moved, deviation)
        self._kept.append((moved, sheet))
        self._away = np.minimum(self._away, np.linalg.norm(self._poses - moved, axis=1))

    def _taken(self, prepared: Prepared, number: int) -> Steps:
        self._now = number
        yield replace(prepared, spots=self._kept[number][1])
