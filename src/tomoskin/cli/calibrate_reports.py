"""What ``tomoskin calibrate`` says of a calibration: facts for programs, lines for people."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from tomoskin.learning import BodyModel, Classifier, Locator, MappingAnswer
    from tomoskin.model.skin import Skin

_SHOWN, _DRIFTED = 10, 2.0
"""Remarks that are listed, and growth of the errors from which the skin has changed."""

_HARDLY = 0.5
"""Part of the labelled frames that are right, below which labels hardly depend on the data."""


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


def class_facts(classifier: Classifier, n_frames: int) -> dict[str, Any]:
    """Names, how many frames, and how well left-out ones are classified."""
    examples, alignment = classifier.examples, classifier.alignment
    return {
        "names": examples.codes.names,
        "exclusive": examples.codes.exclusive,
        "frames": n_frames,
        "labelled": int(examples.part(examples.newest).labelled.sum()),
        "sessions": int(examples.session.max()) + 1,
        "right_when_left_out": classifier.right,
        "alignment": None if alignment is None else asdict(alignment),
    }


def class_lines(classifier: Classifier, facts: dict[str, Any], *, is_aligned: bool) -> list[str]:
    """What :func:`class_facts` gave, in sentences."""
    kind = "classes" if facts["exclusive"] else "flags"
    lines = [
        f"{len(facts['names'])} {kind}: {', '.join(facts['names'])}",
        f"{facts['labelled']} of {facts['frames']} frames labelled; in cross-validation, "
        f"{100 * classifier.right:.0f} % of the labelled frames are right",
    ]
    if classifier.right < _HARDLY:
        lines.append("the labels hardly depend on the data: check that they belong to these frames")
    if is_aligned and classifier.alignment is not None:
        lines.append(classifier.alignment.text)
    return lines


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


def body_facts(model: BodyModel) -> dict[str, Any]:
    """Coordinates of the body, and by how much left-out states are missed."""
    return {
        "frames": len(model.body.time),
        "directions": model.n_modes,
        "errors": dict(zip(model.body.names, model.error.tolist(), strict=True)),
        "remembers": model.remembers,
    }


def body_lines(model: BodyModel, facts: dict[str, Any]) -> list[str]:
    """What :func:`body_facts` gave, in sentences."""
    errors = ", ".join(
        f"{name} {np.degrees(error):.2f}°" if name.startswith("angle") else f"{name} {error:.3g}"
        for name, error in facts["errors"].items()
    )
    lines = [
        f"{facts['frames']} frames, {facts['directions']} directions; in cross-validation "
        f"the RMS errors of the state are: {errors}"
    ]
    if model.remembers:
        lines.append("the sheet's memory is part of the calibration: process frames in their order")
    if not model.examples.names:
        lines.append("nothing measured the state, so it has no unit: --states TABLE.csv gives one")
    elif not model.body.turns and "angle" in model.body.names:
        lines.append(
            "the axis of a bend is estimated from three directions on; here the given axis is used"
        )
    return lines
