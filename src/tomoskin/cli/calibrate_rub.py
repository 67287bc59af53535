"""``tomoskin calibrate rub``: learn where touches are from touches everywhere, without labels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from tomoskin.cli.choices import skin_for_file
from tomoskin.cli.named_files import ForceFlag
from tomoskin.cli.options import CalibrationOut, LabelledArgument, ReferenceOption, SkinOption
from tomoskin.cli.output import Bar, JsonFlag, emit, remark
from tomoskin.cli.recording import changes, idle_frames, say_notes
from tomoskin.core import DataError

if TYPE_CHECKING:
    from tomoskin.core import FloatArray, IntArray
    from tomoskin.learning import Rubbing
    from tomoskin.model.pattern import Pattern
    from tomoskin.sensing.signal import Recording

_STANDS_OUT = 4.0
"""Root mean square of a frame's changes, in noise deviations, from which it shows a touch."""


def calibrate_rub(
    recording: LabelledArgument,
    out: CalibrationOut,
    skin: SkinOption = None,
    reference: ReferenceOption = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Learn where a touch is from one finger that rubs the whole skin, without labels.

    The skin file says where the electrodes are. Five frames with a label improve the result.
    """
    from tomoskin.files.imports import read_recording
    from tomoskin.learning import TOUCH, Rubbing

    data = read_recording(recording)
    say_notes(data)
    rubbed = skin_for_file(skin, recording)
    pattern = rubbed.pattern()
    data = data.in_order_of(pattern)
    dv = changes(data, reference, pattern)
    frames = _touched(data, dv, reference, pattern)
    xy = None if data.labels is None else data.labels[frames]
    with Bar("learning") as bar:
        found = Rubbing.of(dv[frames], rubbed, xy)
        if not found.holds:
            raise DataError("; ".join(found.findings), where=str(recording))
        locator = found.locator(bar)
    for finding in found.findings:
        remark(finding)
    TOUCH.of(locator, pattern, rubbed).write(out, overwrite=force)
    if json:
        emit(_facts(found, len(frames)))
    else:
        typer.echo(f"{len(frames)} frames with a touch, {found.text}")


def _touched(data: Recording, dv: FloatArray, reference: str | None, pattern: Pattern) -> IntArray:
    """Frames whose changes stand out of the untouched frames' noise; all where none is known."""
    import numpy as np

    from tomoskin.sensing.signal import Reference

    idle = idle_frames(data, reference, pattern)
    if idle is None or isinstance(idle, str):
        return np.arange(len(dv))
    rest = Reference.of(idle.real.astype(float))
    if not (rest.noise_is_known and (rest.noise > 0).all()):
        return np.arange(len(dv))
    return np.flatnonzero(np.sqrt(np.nanmean((dv / rest.noise) ** 2, axis=1)) > _STANDS_OUT)


def _facts(found: Rubbing, touched: int) -> dict[str, Any]:
    return {
        "touched_frames": touched,
        "used": len(found.presses),
        "labelled": found.labelled,
        "deviation_mm": 1e3 * found.deviation,
        "alike": found.alike,
    }
