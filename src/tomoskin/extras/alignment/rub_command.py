"""``tomoskin calibrate rub``: touch learnt from one finger that rubs the skin."""

from __future__ import annotations

import numpy as np

from tomoskin.cli import Bar, LearningOutcome, Recorded, calibration_command, found_touches, remark
from tomoskin.core import DataError


@calibration_command("Frames with labels, one touch in each.")
def rub(labelled: Recorded) -> LearningOutcome:
    """Learn where a touch is from one finger that rubs the whole skin, without labels.

    The skin file says where the electrodes are. Five frames with a label improve the result.
    """
    from tomoskin.extras.alignment.rubbing import Rubbing
    from tomoskin.learning import TOUCH

    dv, skin, frames = labelled.dv, labelled.drawn, np.arange(len(labelled.dv))
    if labelled.noise is not None:
        result = found_touches(labelled)
        frames = result.frames[[len(touches) == 1 for touches in result.touches]]
    xy = None if labelled.data.labels is None else labelled.data.labels[frames]
    with Bar("learning") as bar:
        rubbing = Rubbing.of(dv[frames], skin, xy)
        if not rubbing.holds:
            raise DataError("; ".join(rubbing.findings), where=str(labelled.path))
        locator = rubbing.locator(bar).sliding(labelled.data.time[frames], dv[frames])
    for finding in rubbing.findings:
        remark(finding)
    lag = 1e3 * (locator.presses.slide_lag or 0.0)
    facts = {
        "touched_frames": len(frames),
        "used": len(rubbing.presses),
        "labelled": rubbing.labelled,
        "deviation_mm": 1e3 * rubbing.deviation,
        "alike": rubbing.alike,
        "slide_lag_mm": lag,
    }
    lines = [f"{len(frames)} frames with a touch, {rubbing.text}"]
    if lag:
        lines.append(f"the sheet lags {lag:.0f} mm behind a finger that slides: this is corrected")
    made = TOUCH.of(locator, labelled.pattern, skin)
    return LearningOutcome(made.write, facts, lines)
