"""A recording of a board that is not known: what chooses alpha, and which electrodes are open."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import FloatArray
from tomoskin.imaging import AlphaChoice, Greit, Spectrum, for_recording
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import InverseSettings
from tomoskin.pipeline.prepare import Prepared
from tomoskin.pipeline.rest import with_choice
from tomoskin.sensing.signal import Reference

_GREIT_ERROR = 0.003
"""What a model gets wrong in a measurement, as a part of the data of a training target."""

_GREIT_RADIUS = 0.125
"""Radius with which targets are shown: objects nearer than two of them have one maximum. With so
little noise it may be less than usual. Chosen of 0.15, 0.125, 0.1 and 0.075 on the rigs that the
error was chosen by, and the even cases of KIT4: it alone loses none and shows no ghost."""

_COMMON = 10.0
"""All voltages waver in common where their sum's variance is so many times that of noise."""

_TIMES = 5.0
"""A measurement is off that is so many times the model's, or so many times less."""

_SMALL = 0.2
"""Below this part of their rms, what a model expects is too small for such a comparison."""

_OFF = 0.5
"""An electrode is open where at least this part of its measurements is off."""

_LEFT = 0.25
"""At least this part of the measurements stays, or nothing is said of electrodes."""


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
    if inverse.method == "greit":
        return _trained_by_file(prepared, reference)
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


def _trained_by_file(prepared: Prepared, reference: Reference | None) -> Prepared:
    """The trained operator, where its noise figure is the usual one; it says what it rests on."""
    operator = prepared.operator
    figure = prepared.skin.inverse.noise_figure
    if not isinstance(operator, Greit) or figure != InverseSettings.noise_figure:
        return prepared
    weight = _GREIT_ERROR**2 * prepared.pattern.n_meas
    noise = 1.0 / np.sqrt(_weights(prepared, reference))
    trained = operator.weighed(noise, weight, _GREIT_RADIUS)
    reason = f"measurements are trusted to {100 * _GREIT_ERROR:g} % of a target's data"
    return replace(prepared, operator=trained, choice=AlphaChoice(weight, "model-error", reason))


def open_electrodes(pattern: Pattern, measured: NDArray[Any], model: FloatArray) -> list[int]:
    """Electrodes without contact, by voltages (n_meas,) of the untouched skin; the model's too.

    Most of what they drive or read is off by far. The worst is left out first, then the scale of
    the others is taken again. Empty where too little would be left to judge by.
    """
    size, expected = np.abs(measured), np.abs(model)
    rows = np.hstack([pattern.drive, pattern.measure])
    kept, found = np.isfinite(size), list[int]()
    while kept.mean() >= _LEFT:
        scaled = expected * _scale(size[kept], expected[kept])
        small = _SMALL * np.sqrt(np.mean(scaled[kept] ** 2))
        off = (size > _TIMES * np.maximum(scaled, small)) | (_TIMES * size < scaled - small)
        own = [(rows == e).any(axis=1) & kept for e in range(pattern.n_electrodes)]
        part = [float(off[mine].mean()) if mine.any() else 0.0 for mine in own]
        worst = int(np.argmax(part))
        if part[worst] < _OFF:
            return sorted(found)
        found.append(worst)
        kept &= ~own[worst]
    return []


def _scale(size: FloatArray, expected: FloatArray) -> float:
    """Measured over expected, as most of all measurements have it to within a factor of two."""
    ratio = np.log(np.maximum(size, 1e-300) / np.maximum(expected, 1e-300))
    alike = (np.abs(ratio[:, None] - ratio) < np.log(2.0)).sum(axis=1)
    return float(np.exp(ratio[int(alike.argmax())]))
