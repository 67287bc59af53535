"""Rules that choose alpha: each a function of the spectrum and of what is known beside it."""

from __future__ import annotations

from collections.abc import Callable

from tomoskin.core import ModelError
from tomoskin.inverse.choice import AlphaChoice, Evidence
from tomoskin.inverse.labelled import labelled
from tomoskin.inverse.light_touch import light_touch
from tomoskin.inverse.rule_of_figure import noise_figure_rule
from tomoskin.inverse.rules_of_frames import discrepancy, gcv, l_curve, likelihood
from tomoskin.inverse.spectrum import Spectrum

Rule = Callable[[Spectrum, Evidence], AlphaChoice]

RULES: dict[str, Rule] = {
    "light-touch": light_touch,
    "noise-figure": noise_figure_rule,
    "l-curve": l_curve,
    "gcv": gcv,
    "likelihood": likelihood,
    "discrepancy": discrepancy,
    "labelled": labelled,
}
"""Rules by name. The first needs nothing but the noise; ``alpha = "auto"`` is decided by it."""


def choose(spectrum: Spectrum, rule: str, evidence: Evidence) -> AlphaChoice:
    """The choice of the named rule.

    Raises
    ------
    ModelError
        For an unknown name, or where the rule finds no alpha.
    DataError
        When the evidence lacks what the rule needs.
    """
    if rule not in RULES:
        raise ModelError(f'expected a rule among {", ".join(RULES)}, got "{rule}"')
    return RULES[rule](spectrum, evidence)
