"""What ``tomoskin calibrate`` says of a calibration: facts for programs, lines for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from tomoskin.learning import Locator, MappingAnswer
    from tomoskin.model.skin import Skin

_SHOWN, _DRIFTED = 10, 2.0
"""Remarks that are listed, and growth of the errors from which the skin has changed."""


def touch_facts(
    locator: Locator, frames: list[int], older: Locator | None = None
) -> dict[str, Any]:
    """Errors of left-out presses; ``frames`` are those of the newest presses, and ``older`` has
    learnt from the others."""
    from tomoskin.learning import LeftOut, growth_of_errors

    left_out = LeftOut.of(locator)
    before = len(locator.presses) - len(frames)
    errors = 1e3 * locator.errors
    return {
        "presses": len(locator.presses),
        "mean_mm": float(errors.mean()),
        "median_mm": float(np.median(errors)),
        "p95_mm": float(np.percentile(errors, 95)),
        "guessed_mm": 1e3 * left_out.guessed,
        "is_guess": left_out.is_guess,
        "held_by_90_percent_ellipses": locator.held,
        "one_force": left_out.one_force,
        "drift": left_out.drift,
        "growth": growth_of_errors(locator, older),
        "never_measured": np.flatnonzero(~np.isfinite(locator.presses.dv).any(axis=0)).tolist(),
        "next_press_mm": (1e3 * locator.next_place()).tolist(),
        "remarks": [
            {"frame": frames[r.row - before] if r.row >= before else None, "reason": r.reason}
            for r in locator.remarks
        ],
    }


def touch_lines(facts: dict[str, Any]) -> list[str]:
    """What :func:`touch_facts` gave, in sentences."""
    from tomoskin.learning import worse

    lines = [
        f"{facts['presses']} presses; each press left out in turn, the mean error is "
        f"{facts['mean_mm']:.1f} mm (median {facts['median_mm']:.1f}, 95 % "
        f"{facts['p95_mm']:.1f}), and {100 * facts['held_by_90_percent_ellipses']:.0f} % lie "
        "within their 90 % ellipses"
    ]
    if facts["one_force"]:
        lines.append(
            "all presses were about equally hard: softer and harder ones have larger errors; add "
            "some of both with --onto"
        )
    if missing := facts["never_measured"]:
        lines.append(f"measurements without a value in any press: {', '.join(map(str, missing))}")
    for doubtful in facts["remarks"][:_SHOWN]:
        frame = doubtful["frame"]
        who = "an older press" if frame is None else f"frame {frame:>4}"
        lines.append(f"{who}  uncertain: {doubtful['reason']}")
    if len(facts["remarks"]) > _SHOWN:
        lines.append(f"… and {len(facts['remarks']) - _SHOWN} more: --json lists all")
    if facts["drift"] > _DRIFTED:
        lines.append(
            f"the errors of the last presses are {facts['drift']:.1f} times as large as usual: "
            "the skin has changed; press it again"
        )
    if what := worse(facts["growth"]):
        lines.append(
            f"{what}. Check their labels and the wiring; where the skin has changed, calibrate it "
            "again"
        )
    x, y = facts["next_press_mm"]
    return [*lines, f"the next press is most useful at x {x:+.0f} mm, y {y:+.0f} mm"]


def mapping_facts(answer: MappingAnswer, skin: Skin, frames: list[int]) -> dict[str, Any]:
    """The mapping and how sure it is; ``frames`` are those of the presses."""
    from tomoskin.learning import ring_of

    ring = ring_of(skin)
    polarity = "reversed" if answer.mapping.reversed else "normal"
    return {
        "presses": len(frames),
        "sure": answer.sure,
        "mapping": answer.mapping.text(ring),
        "places": list(answer.mapping.electrodes),
        "polarity": polarity if answer.polarity_known else "not known",
        "probability": answer.probability,
        "runner_up": answer.runner_up.text(ring),
        "odds": min(answer.odds, 1e300),
        "unexplained": answer.unexplained,
        "next_press_mm": (1e3 * answer.next_place).tolist(),
        "remarks": [
            {"frame": frames[row], "looks_like_mm": [1e3 * x, 1e3 * y]}
            for row, x, y in answer.contradicted
        ],
    }


def mapping_lines(facts: dict[str, Any]) -> list[str]:
    """What :func:`mapping_facts` gave, in sentences."""
    lines = [
        f"{facts['presses']} presses: {facts['mapping']}",
        f"probability {facts['probability']:.3f}; {min(facts['odds'], 1e6):.3g} times as likely as "
        f"the next: {facts['runner_up']}",
    ]
    if facts["polarity"] == "not known":
        lines.append(
            "the polarity is not known: give untouched frames, or set [touch] sign in the skin file"
        )
    for doubtful in facts["remarks"]:
        x, y = doubtful["looks_like_mm"]
        lines.append(
            f"frame {doubtful['frame']:>4}  uncertain: fits a press at x {x:+.0f} mm, y "
            f"{y:+.0f} mm better"
        )
    return lines
