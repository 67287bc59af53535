"""``alpha = "auto"``: the operator follows the noise that the reference shows, in small steps."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from tomoskin.core import ModelError
from tomoskin.inverse import Assembly, Evidence, Spectrum, choose
from tomoskin.signal import Reference

if TYPE_CHECKING:
    from tomoskin.pipeline.prepare import Prepared

_SAME = 0.05
"""An alpha that differs by less than this part is left as it is: the picture is the same."""

_STEP = 2e7
"""Multiplications of one step: about a millisecond on one core."""


def tune(prepared: Prepared, reference: Reference) -> Generator[None, None, Prepared]:
    """The skin prepared anew for the noise of ``reference``, a piece between each two yields.

    Returns ``prepared`` itself where alpha was set by hand, the noise is not known or not above
    zero, or the alpha would hardly change.
    """
    if prepared.light_touch is None or not reference.noise_is_known or not reference.noise.any():
        return prepared
    noise = prepared.difference_noise(reference)
    choice = prepared.light_touch(noise)
    if abs(np.log(choice.alpha / prepared.choice.alpha)) < _SAME:
        return prepared
    yield
    spectrum = prepared.light_touch.spectrum
    assembly = Assembly(spectrum, choice.alpha)
    rows = max(int(_STEP / len(noise) ** 2), 1)
    while not assembly.done:
        assembly.advance(rows)
        yield
    reason = f"{choice.reason}, measured on {reference.n_frames} idle frames"
    return prepared.with_alpha(replace(choice, reason=reason), spectrum, assembly.operator())


def tuned(prepared: Prepared, reference: Reference) -> Prepared:
    """As :func:`tune`, at once."""
    steps = tune(prepared, reference)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            found: Prepared = end.value
            return found


def tuned_by_rule(prepared: Prepared, rule: str, evidence: Evidence) -> Prepared:
    """The skin prepared anew with the alpha of the named rule.

    Raises
    ------
    ModelError
        When the rule is not known or finds no alpha, or the method has none.
    DataError
        When the evidence lacks what the rule needs.
    """
    if prepared.skin.inverse.method != "one-step":
        raise ModelError(
            f'rules choose the alpha of method "one-step", and the skin\'s is '
            f'"{prepared.skin.inverse.method}"',
            where=prepared.skin.name,
            hint="leave the rule out, or change the method in the skin's [inverse]",
        )
    spectrum = Spectrum.of(prepared.problem)
    choice = choose(spectrum, rule, evidence)
    found = prepared.with_alpha(choice, spectrum, spectrum.operator(choice.alpha))
    return replace(found, light_touch=None)
