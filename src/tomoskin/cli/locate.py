"""``tomoskin locate``: places of touches by a calibration."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.named_files import ForceFlag, Reads
from tomoskin.cli.named_parts import Recorded, reconstructed, say_scale
from tomoskin.cli.options import RecordingArgument, ReferenceOption, SameSkinOption, TouchesOut
from tomoskin.cli.output import Bar, JsonFlag, remark, tell

if TYPE_CHECKING:
    from tomoskin.core import FloatArray, Touch
    from tomoskin.learning import Calibration, CalibrationHealth, Locator
    from tomoskin.model.skin import Skin

_BLOCK = 256
_NINETY = 1645.0
"""Millimetres on either side within which nine in ten lie, of a deviation of 1 m."""

_SHOWN = 20


def locate(
    recording: RecordingArgument,
    calibration: Annotated[
        Path, typer.Option(metavar="C.npz", help="File from tomoskin calibrate touch."), Reads()
    ],
    touches: TouchesOut = None,
    force: ForceFlag = False,
    skin: SameSkinOption = None,
    reference: ReferenceOption = None,
    several: Annotated[
        bool, typer.Option("--several", help="Locate two touches where a frame shows two; slower.")
    ] = False,
    json: JsonFlag = False,
) -> None:
    """Find the touches of a session by a calibration, or the one press (with --several up to two)
    in every frame of another file."""
    from tomoskin.files.exports import write_touches
    from tomoskin.files.imports import is_session
    from tomoskin.learning import TOUCH
    from tomoskin.sensing.track import columns_of, touch_rows

    with Bar("learning") as bar:
        loaded = TOUCH.read(calibration, bar)
    given = Recorded.of(recording, skin, reference).onto(loaded)
    data = given.data
    say_scale(given, [loaded])
    if given.skin is not None and is_session(recording) and not several:
        frames, located = _in_flow(given, given.skin, loaded)
    else:
        frames, located = _alone(given, loaded, several=several)
    timed = list(zip(frames, data.time[frames].tolist(), located, strict=True))
    if touches is not None:
        write_touches(touches, timed, overwrite=force)
    document = [dict(zip(columns_of(), row, strict=True)) for row in touch_rows(timed)]
    tell(document, _lines([(k, touch) for k, _, some in timed for touch in some]), json=json)


Located = tuple[list[int], list[tuple["Touch", ...]]]
"""Frames, and the touches in each."""


def _in_flow(given: Recorded, skin: Skin, loaded: Calibration[Locator]) -> Located:
    """As a live run with the calibration finds and locates them."""
    from tomoskin.pipeline import prepare

    with Bar("preparing"):
        prepared = prepare(skin).calibrated(loaded)
    with Bar("locating") as bar:
        result = reconstructed(given, prepared, None, bar)
    return result.frames.tolist(), list(result.touches)


def _alone(given: Recorded, loaded: Calibration[Locator], *, several: bool) -> Located:
    """By the calibration alone: each frame is one press, or two, of a skin that may be unknown."""
    import numpy as np

    from tomoskin.sensing.track import Rim

    dv = given.dv
    frames = np.flatnonzero(np.isfinite(dv[:, loaded.model.features.rows]).any(axis=1))
    if len(frames) < len(dv):
        remark(
            f"{given.path}: {len(dv) - len(frames)} frames hold no finite value and were left out"
        )
    _say_health(_strangeness(loaded.model, dv[frames]))
    located = list((_several if several else _single)(loaded, dv[frames]))
    if given.skin is not None:
        on_sheet = Rim.of(given.skin.outline).on_sheet
        located = [tuple(map(on_sheet, touches)) for touches in located]
    return frames.tolist(), located


def _strangeness(locator: Locator, dv: FloatArray) -> CalibrationHealth:
    import numpy as np

    from tomoskin.learning import CalibrationHealth

    strange = float(np.median(locator.strangeness(dv))) if len(dv) else np.nan
    return CalibrationHealth(len(dv), strange)


def _say_health(health: CalibrationHealth) -> None:
    """Say what speaks against the calibration."""
    for finding in () if health.well else health.findings:
        remark(finding)


def _several(loaded: Calibration[Locator], dv: FloatArray) -> Iterator[tuple[Touch, ...]]:
    from tomoskin.core import Touch
    from tomoskin.learning import Several

    both = Several.of(loaded.model)
    with Bar("locating") as bar:
        for number, frame in enumerate(dv):
            bar(number, len(dv))
            (detections,) = both(frame)
            yield tuple(
                Touch(k, "touch", 0.0, detection) for k, detection in enumerate(detections, 1)
            )


def _single(loaded: Calibration[Locator], dv: FloatArray) -> Iterator[tuple[Touch, ...]]:
    from tomoskin.core import Touch
    from tomoskin.learning import Watch, detection_at

    locator = loaded.model
    watch = Watch(locator)
    for start in range(0, len(dv), _BLOCK):
        part = dv[start : start + _BLOCK]
        answers = zip(*watch(part), locator.strength(part).tolist(), strict=True)
        for position, covariance, peak in answers:
            detection = detection_at(position, covariance, peak)
            yield (Touch(id=1, kind="touch", since=0.0, detection=detection),)
    _say_health(replace(watch.health, presses=0))  # strangeness has been said of all frames


def _lines(rows: list[tuple[int, Touch]]) -> Iterator[str]:
    for frame, touch in rows[:_SHOWN]:
        r = touch.detection
        close = "" if touch.said == touch.kind else f"  {touch.said}"
        yield (
            f"frame {frame:>4}  x {1e3 * r.x:+7.1f} ± {_NINETY * r.sd_x:4.1f} mm  "
            f"y {1e3 * r.y:+7.1f} ± {_NINETY * r.sd_y:4.1f} mm  strength {r.peak:.2f}{close}"
        )
    if rows:
        yield "nine in ten positions lie within ± along each axis"
    if len(rows) > _SHOWN:
        yield f"… and {len(rows) - _SHOWN} more touches: --touches writes all"
