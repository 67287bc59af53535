"""``tomoskin image``: reconstruct a recording off-line."""

from __future__ import annotations

import math
from collections import Counter
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli import options
from tomoskin.cli.choices import quantity, skin_for_file, with_recorded_calibrations
from tomoskin.cli.named_files import TABLE, Added, ForceFlag, Writes
from tomoskin.cli.named_parts import (
    Recorded,
    deformation_lines,
    first_time,
    reconstructed,
    say_notes,
    say_scale,
    span_lines,
)
from tomoskin.cli.output import Bar, JsonFlag, remark, tell
from tomoskin.core import MEASURANDS, DataError, no_such

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tomoskin.core import Touch
    from tomoskin.files.exports import Display
    from tomoskin.model.skin import Skin
    from tomoskin.pipeline import Prepared, Reconstruction, Unresolved
    from tomoskin.sensing.signal import Recording
    from tomoskin.sensing.track import Span


_MOST_FIELDS = 200
"""Frames of a .vtu file."""

_TOLD = 3
"""Problems that are told: those that most frames have."""

IMAGES = {
    ".png": "pictures of some frames",
    ".npz": "images of all frames with their mesh, and what the data leave open",
    ".vtu": "the mesh with a field for each frame, and what the data leave open",
}


@dataclass(frozen=True)
class Tuned:
    """With what images are made, instead of what the skin or the session says."""

    alpha: Annotated[
        str | None,
        typer.Option(
            metavar="NUMBER|auto|RULE",
            help="Weight of the prior instead of the skin's; `skin alpha` lists the values of "
            "RULE.",
        ),
    ] = None
    time_constant: Annotated[
        str | None,
        typer.Option(
            metavar="TIME",
            help='Time constant of the images, such as "0.2 s", instead of the skin\'s. With '
            '"0 s" each image uses its own frame alone.',
        ),
    ] = None
    calibration: options.CalibrationsOption = None

    def of(self, skin: Skin) -> tuple[Skin, str | None]:
        """The skin with them, and the rule that is to choose alpha, if one was named."""
        from tomoskin.imaging import RULES

        if self.time_constant is not None:
            quantity(self.time_constant, "time", "--time-constant")
            skin = skin.altered({"inverse": {"time_constant": self.time_constant}})
        given = self.alpha
        if given is None or given in RULES:
            return skin, given
        alpha: str | float = given
        if given != "auto":
            with suppress(ValueError):
                alpha = float(given)
            if not (isinstance(alpha, float) and 1e-9 <= alpha <= 1e9):
                what = "a number above 0, or a word"
                raise typer.BadParameter(
                    no_such(given, ("auto", *RULES), what), param_hint="--alpha"
                )
        return skin.altered({"inverse": {"alpha": alpha}}), None


@dataclass(frozen=True)
class Shown:
    """The unit, filter and colour scale in which images are shown."""

    percent: Annotated[
        bool,
        typer.Option("--percent", help="Show changes in per cent of the skin's own conductivity."),
    ] = False
    limit: Annotated[
        float | None,
        typer.Option(
            metavar="X", help="End of the colour scale, in the unit shown: S or per cent."
        ),
    ] = None
    smooth: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH",
            help='Average over discs of this radius, such as "8 mm". It changes the picture, not '
            "the touches.",
        ),
    ] = None

    def of(self, skin: Skin) -> Display:
        """For images of ``skin``. Raises DataError for what cannot be."""
        from tomoskin.files.exports import Display

        percent, limit = self.percent, self.limit
        return Display(
            conductivity=skin.conductivity if percent else None,
            smoothing=quantity(self.smooth, "length", "--smooth") if self.smooth else 0.0,
            limit=limit / 100.0 if percent and limit is not None else limit,
        )


@dataclass(frozen=True)
class Results:
    """The files that are written, and whether older ones may be."""

    out: Annotated[
        Path | None,
        typer.Option(metavar="X.png|.npz|.vtu", help="File for the images."),
        Writes(IMAGES),
    ] = None
    touches: options.TouchesOut = None
    deformations: options.DeformationsOut = None
    force: ForceFlag = False
    thorough: Annotated[
        Path | None,
        typer.Option(
            metavar="X.csv",
            help="File for what a longer search of each frame by itself finds; slower.",
        ),
        Writes(TABLE),
    ] = None

    def write_deformations(self, result: Reconstruction) -> None:
        """How the sheet is deformed in each frame, where that is asked for."""
        from tomoskin.files.exports import write_deformations

        if self.deformations is not None:
            frames, times = result.frames.tolist(), result.time.tolist()
            rows = zip(frames, times, result.deformations, strict=True)
            write_deformations(self.deformations, rows, overwrite=self.force)


def image(
    recording: options.RecordingArgument,
    skin: options.SkinOption = None,
    reference: options.ReferenceOption = None,
    frames: options.FramesOption = None,
    *,
    tuned: Tuned,
    shown: Shown,
    added: Added,
    results: Results,
    json: JsonFlag = False,
) -> None:
    """Write the images of a recording and the touches in them, or say what they are."""
    from tomoskin.files.exports import write_touches
    from tomoskin.files.imports import read_recording
    from tomoskin.pipeline import ALONE, located_alone, prepare, with_calibrations
    from tomoskin.sensing.track import touch_spans

    own = skin_for_file(skin, recording)
    chosen, rule = tuned.of(own)
    display = shown.of(chosen)
    touches, thorough, force = results.touches, results.thorough, results.force
    data = read_recording(recording)  # what cannot be read is said before the work
    with Bar("preparing"):
        prepared = prepare(chosen)
        if tuned.calibration or skin is not None:
            prepared = with_calibrations(prepared, tuned.calibration or (), own)
        else:
            prepared = with_recorded_calibrations(prepared, recording)
    given = Recorded(recording, data, prepared.skin, reference, prepared.pattern)
    say_scale(given, prepared.calibrations.values())
    for doubt in chain.from_iterable(one.doubts(data, prepared) for one in added):
        remark(doubt)
    say_notes(given.data)
    with Bar("reconstructing") as bar:
        result = reconstructed(given, prepared, frames, bar, rule=rule)
    for one in added:
        result = one.changed(result, prepared, given.data, given.against)
    surface, measured = prepared.skin.surface, prepared.calibrations
    tables = {touches: result}
    if thorough is not None:
        with Bar("searching each frame") as bar:
            tables[thorough] = reconstructed(given, prepared, frames, bar, rule=rule, setting=ALONE)
    for path, part in tables.items():
        if path is not None:
            rows = zip(part.frames.tolist(), part.time.tolist(), part.touches, strict=True)
            write_touches(path, rows, surface, measured=measured, overwrite=force)
    results.write_deformations(result)
    if results.out is not None:
        write = WRITERS[results.out.suffix.lower()]
        write(results.out, prepared, result, display, overwrite=force)
    _warn(given.data, result, prepared)
    if located_alone(prepared, result.model_agreement):
        remark(f"{recording}: the calibration alone locates touches, one at a time")
    since = (result.time - first_time(given.data)).tolist()
    spans = touch_spans(zip(since, result.touches, strict=True))
    lines = _lines(result, spans, prepared)
    lines += deformation_lines(zip(since, result.deformations, strict=True))
    if thorough is not None:
        count = sum(map(len, tables[thorough].touches))
        lines.append(f"{thorough}: each frame searched by itself, {count} touches in them all")
    if not given.data.board_known:
        lines.append(_unknowable(chosen))
    if not given.data.timed:
        lines.append("the file has no times of its frames, so each is searched by itself")
    tell(_document(result, spans, prepared), lines, json=json)


def _lines(result: Reconstruction, spans: tuple[Span, ...], prepared: Prepared) -> list[str]:
    import numpy as np

    from tomoskin.learning import MEASURED, calibration_kinds

    number = "1 touch" if len(spans) == 1 else f"{len(spans)} touches"
    lines = [f"{len(result.frames) + len(result.unseen)} frames, {number}"]
    if len(result.unseen):
        lines.append(f"{len(result.unseen)} of them were held or skipped in the run")
    if math.isfinite(result.agreement):
        lines.append(result.model_agreement.text)
    choice = result.choice
    lines.append(f"alpha {choice.alpha:.4g} ({choice.rule}: {choice.reason})")
    if prepared.modes is not None:
        seconds = prepared.skin.inverse.time_constant
        lines.append(f"filtered over frames, time constant {seconds:g} s")
    for kind in calibration_kinds():
        if kind.reading is None or not any(result.readings.get(kind.name, ())):
            continue
        counts = Counter(one.word for one in result.readings[kind.name] if one).items()
        lines.append(", ".join(f"{name}: {count} frames" for name, count in counts))
    lines += span_lines(spans, result.unit)
    amounts = [touch.amounts for touches in result.touches for touch in touches]
    for name, of in MEASURED.items():
        if values := [one[name].value for one in amounts if name in one]:
            lines.append(f"{of.plural} from {of.span(np.array(values))}")
    if spans:
        lines.append(
            "times count from the first frame; --touches X.csv writes each touch in each frame"
        )
    return lines


def _warn(recorded: Recording, result: Reconstruction, prepared: Prepared) -> None:
    """Say on stderr what was left out, and what looks wrong."""
    from tomoskin.files.imports import is_session
    from tomoskin.model.skin import regions_doubt

    source = Path(recorded.source)
    for note in result.notes:
        remark(f"{source}: {note}")
    if is_session(source):  # there, what is missing is said as live: by electrode
        counted: list[tuple[int, int]] = []
    else:
        counted = list(zip(result.frames.tolist(), result.rows_missing.tolist(), strict=True))
    without = set(result.left_out.tolist())
    named = [f"{frame} ({_rows(k)})" for frame, k in counted if k and frame not in without]
    if named:
        remark(
            f"{source}: {len(named)} frames hold values that are not finite; these rows were "
            f"left out: {_listed(named)}"
        )
    for text, some in sorted(result.problems.items(), key=lambda item: -len(item[1]))[:_TOLD]:
        remark(f"{source}: {len(some)} frames, from {some[0]} on: {text}")
    if blank := [frame for frame, k in counted if k and frame in without]:
        remark(
            f"{source}: {len(blank)} frames hold too many values that are not finite "
            f"and show no image: {_listed(blank)}"
        )
    if (doubt := result.model_agreement.doubt(volts=is_session(source))) is not None:
        remark(f"{source}: {doubt}")
    skin, ambiguity = prepared.skin, prepared.ambiguity
    if (doubt := regions_doubt(skin.inverse, skin.touch)) is not None:
        remark(f"{skin.source}: {doubt}")
    if ambiguity is not None:
        remark(f"{skin.source}: {ambiguity.text}")


def _document(
    result: Reconstruction, spans: tuple[Span, ...], prepared: Prepared
) -> dict[str, Any]:
    from tomoskin.files.messages import deformation_content

    missing = zip(result.frames.tolist(), result.rows_missing.tolist(), strict=True)
    return {
        "frames": len(result.frames),
        "rows_missing": {str(frame): rows for frame, rows in missing if rows},
        "left_out": result.left_out.tolist(),
        "unseen": result.unseen.tolist(),
        "rows_left_out": result.rows_left_out.tolist(),
        "agreement": result.agreement,
        "size": result.model_agreement.size,
        "unit": result.unit,
        "alpha": result.choice.alpha,
        "rule": result.choice.rule,
        "time_constant_s": prepared.skin.inverse.time_constant,
        **_readings(result),
        "spans": [
            {
                "id": span.id,
                "kind": span.kind,
                "begin_s": span.begin,
                "end_s": span.end,
                "x_m": span.x,
                "y_m": span.y,
                "peak": span.peak,
            }
            for span in spans
        ],
        "deformations": [
            {"frame": frame, **content}
            for frame, one in zip(result.frames.tolist(), result.deformations, strict=True)
            if (content := deformation_content(one)) is not None
        ],
        "touches": [
            {
                "frame": f,
                "id": t.id,
                "x_m": t.detection.x,
                "y_m": t.detection.y,
                "peak": t.detection.peak,
                "elsewhere_m": t.elsewhere,
                **_amounts(t),
            }
            for f, touches in zip(result.frames.tolist(), result.touches, strict=True)
            for t in touches
        ],
    }


def _readings(result: Reconstruction) -> dict[str, list[dict[str, Any]]]:
    """What calibrations read in each frame beside its touches, one list for each kind."""
    from tomoskin.learning import calibration_kinds

    return {
        kind.reading.listed: [
            {"frame": frame, **reading.facts}
            for frame, reading in zip(
                result.frames.tolist(), result.readings.get(kind.name, ()), strict=False
            )
            if reading
        ]
        for kind in calibration_kinds()
        if kind.reading is not None
    }


def _unknowable(skin: Skin) -> str:
    """What no data can tell of a file's image, and which keys of the skin file say it."""
    given = skin.document["electrodes"]
    keys = "positions"
    if given.get("count") is not None:
        keys = f'first = "{given["first"]}" and order = "{given["order"]}"'
    return f"no data can tell how this is turned or mirrored: {keys} of [electrodes] in the skin do"


def _amounts(touch: Touch) -> dict[str, Any]:
    """Its force and its depth, where calibrations tell them."""
    return {
        f"{name}_{MEASURANDS[name].lower()}": asdict(amount)
        for name, amount in touch.amounts.items()
    }


def _listed(frames: Sequence[object]) -> str:
    shown = ", ".join(map(str, frames[:10]))
    return f"{shown}, …" if len(frames) > 10 else shown


def _rows(count: int) -> str:
    return "1 row" if count == 1 else f"{count} rows"


def _png(
    path: Path, prepared: Prepared, result: Reconstruction, display: Display, *, overwrite: bool
) -> None:
    """Draw all frames, or as many as fit, evenly spread over the recording."""
    import numpy as np

    from tomoskin.files.exports import MOST_PANELS, Panel, write_picture

    n = len(result.frames)
    chosen = np.unique(np.linspace(0, n - 1, min(n, MOST_PANELS)).round().astype(int))
    images, unit = display.applied(result.images[chosen], prepared.mesh, result.unit)
    panels = [
        Panel(f"frame {result.frames[i]}", image, result.touches[i])
        for i, image in zip(chosen, images, strict=True)
    ]
    write_picture(path, prepared.mesh, panels, unit, display.limit, overwrite=overwrite)


def _npz(
    path: Path, prepared: Prepared, result: Reconstruction, display: Display, *, overwrite: bool
) -> None:
    """Write images (n_frames, n_cells) with their mesh."""
    import numpy as np

    from tomoskin.core import save_arrays

    images, unit = display.applied(result.images, prepared.mesh, result.unit)
    arrays = {
        "images": images,
        "frames": result.frames,
        "unit": np.array(unit),
        "smoothing_m": np.array(display.smoothing),
        "mesh_id": np.array(prepared.mesh.identity),
        "points": prepared.mesh.points,
        "cells": prepared.mesh.cells,
    }
    if (map_ := _unresolved(prepared, result)) is not None:
        arrays |= {"unresolved": map_.values, "unresolved_radius_m": np.array(map_.radius)}
    save_arrays(path, arrays, overwrite=overwrite)


def _vtu(
    path: Path, prepared: Prepared, result: Reconstruction, display: Display, *, overwrite: bool
) -> None:
    """Write one cell field a frame."""
    from tomoskin.files.exports import write_vtu

    if len(result.frames) > _MOST_FIELDS:
        raise DataError(
            f"a .vtu file holds at most {_MOST_FIELDS} frames, got {len(result.frames)}",
            where=str(path),
            hint="choose fewer frames with --frames A:B",
        )
    images, _ = display.applied(result.images, prepared.mesh, result.unit)
    names = [f"frame_{frame:06d}" for frame in result.frames.tolist()]
    fields = dict(zip(names, images, strict=True))
    if (map_ := _unresolved(prepared, result)) is not None:
        fields["unresolved"] = map_.values
    write_vtu(path, prepared.mesh, fields, overwrite=overwrite)


def _unresolved(prepared: Prepared, result: Reconstruction) -> Unresolved | None:
    """What the data of these images cannot tell; None of a trained operator."""
    from tomoskin.pipeline import Unresolved

    if prepared.skin.inverse.method != "one-step":
        return None
    return Unresolved.of(prepared, result.choice.alpha, result.rows_left_out)


WRITERS = {".png": _png, ".npz": _npz, ".vtu": _vtu}
