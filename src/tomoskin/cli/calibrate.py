"""``tomoskin calibrate``: learn from labelled presses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from tomoskin.cli.output import JsonFlag, emit
from tomoskin.cli.progress import Bar
from tomoskin.cli.recording import ReferenceOption, say_notes

if TYPE_CHECKING:
    from tomoskin.pattern import Pattern
    from tomoskin.session import Calibration, Recording
    from tomoskin.skin import Skin

app = typer.Typer(help="Learn from labelled presses.", no_args_is_help=True)

_SHOWN = 10
_DRIFTED = 2.0


@app.callback()
def _calibrate() -> None:
    """Keep the sub-command's name even while there is only one."""


@app.command("touch")
def touch(
    recording: Annotated[
        Path, typer.Argument(metavar="INPUT", help="Frames with labels: one touch each.")
    ],
    out: Annotated[Path, typer.Option(metavar="C.npz", help="Where the calibration goes.")],
    skin: Annotated[
        str | None,
        typer.Option(help="Built-in name or path; without it the rows are taken as they are."),
    ] = None,
    reference: ReferenceOption = None,
    json: JsonFlag = False,
) -> None:
    """Learn where a touch is from presses at known places."""
    from tomoskin.cli.labelled import changes, labels
    from tomoskin.session import Calibration, read_recording, write_calibration
    from tomoskin.touch import Locator

    whole = read_recording(recording)
    say_notes(whole)
    known, pattern = _what_of(skin, recording, whole)
    whole = whole.in_order_of(pattern)
    xy, dv = labels(whole), changes(whole, reference, pattern)
    frames = np.flatnonzero(np.isfinite(xy).all(axis=1))
    with Bar("learning") as bar:
        locator = Locator.fit(dv[frames], xy[frames], pattern=pattern, skin=known, progress=bar)
    calibration = Calibration(locator, pattern, known.name if known else "")
    write_calibration(out, calibration)
    found = _findings(calibration, frames.tolist())
    if json:
        emit(found)
    else:
        _say(found)


def _what_of(name: str | None, path: Path, whole: Recording) -> tuple[Skin | None, Pattern]:
    """The skin, where there is one, and the table of rows."""
    from tomoskin.cli.skin_choice import skin_for_file
    from tomoskin.pattern import Pattern
    from tomoskin.session import is_session

    if name is None and not is_session(path):
        return None, Pattern.from_tables(whole.drive, whole.measure)
    skin = skin_for_file(name, path)
    return skin, skin.pattern()


def _findings(calibration: Calibration, frames: list[int]) -> dict[str, Any]:
    locator = calibration.locator
    errors = 1e3 * locator.errors
    x, y = (1e3 * locator.next_place()).tolist()
    return {
        "presses": len(locator.presses),
        "mean_mm": float(errors.mean()),
        "median_mm": float(np.median(errors)),
        "p95_mm": float(np.percentile(errors, 95)),
        "held_by_90_percent_ellipses": locator.held,
        "drift": locator.drift,
        "next_press_mm": [x, y],
        "remarks": [{"frame": frames[r.row], "reason": r.reason} for r in locator.remarks],
    }


def _say(found: dict[str, Any]) -> None:
    typer.echo(
        f"{found['presses']} presses; left out of the learning they are missed by "
        f"{found['mean_mm']:.1f} mm (median {found['median_mm']:.1f}, 95 % {found['p95_mm']:.1f}), "
        f"and their 90 % ellipses hold {100 * found['held_by_90_percent_ellipses']:.0f} %"
    )
    for remark in found["remarks"][:_SHOWN]:
        typer.echo(f"frame {remark['frame']:>4}  doubtful: {remark['reason']}")
    if len(found["remarks"]) > _SHOWN:
        typer.echo(f"… and {len(found['remarks']) - _SHOWN} more: --json lists them all")
    if found["drift"] > _DRIFTED:
        typer.echo(
            f"the last presses are missed {found['drift']:.1f} times as far as usual: "
            "the skin has changed; press it anew"
        )
    x, y = found["next_press_mm"]
    typer.echo(f"the next press tells most at x {x:+.0f} mm, y {y:+.0f} mm")
