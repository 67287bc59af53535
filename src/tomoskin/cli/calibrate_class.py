"""``tomoskin calibrate class``: learn which class a frame shows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from tomoskin.cli.frame_ranges import labels_of_frames
from tomoskin.cli.named_files import ForceFlag, Reads
from tomoskin.cli.options import CalibrationOut, KnownSkinOption, ReferenceOption
from tomoskin.cli.output import Bar, JsonFlag, emit
from tomoskin.cli.recording import changes, say_notes
from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from tomoskin.core import Arrays
    from tomoskin.learning import Alignment, Calibration, Codes, Examples, FrameClassifier
    from tomoskin.model.pattern import Pattern
    from tomoskin.model.skin import Skin


def marked(path: Path, dv: FloatArray, given: list[str], codes: Codes | None) -> Examples:
    """Examples of the frames ``dv`` (n, n_meas) of a file; ``codes`` where they are known before.

    Raises
    ------
    DataError
        When nothing says what the frames show (and ``codes`` are not known), or it is no label.
    """
    from tomoskin.learning import Codes, Examples

    arrays = {} if given else _arrays(path)
    if "flags" in arrays:
        flags = np.asarray(arrays["flags"], dtype=np.float64)
        count = flags.shape[1] if flags.ndim == 2 else 0
        names = arrays.get("flag_names", np.arange(1, count + 1)).ravel().tolist()
        own = Codes(tuple(map(str, names)), exclusive=False)
        return Examples.of(codes or own, dv, flags)
    if given or "class" in arrays:
        labels = (
            labels_of_frames(given, len(dv), "--class", "NAME")
            if given
            else [str(s) for s in arrays["class"].tolist()]
        )
        codes = codes or Codes.of_labels(labels)
        return Examples.of(codes, dv, codes.flags_of(labels))
    if codes is None:
        raise DataError(
            "holds no classes: expected class (n_frames,) or flags (n_frames, f)",
            where=str(path),
            hint="add one of them, or --class idle=0:40 --class touch=40:80",
        )
    return Examples.of(codes, dv, np.full((len(dv), len(codes.names)), np.nan))


def _arrays(path: Path) -> Arrays:
    from tomoskin.core import load_arrays
    from tomoskin.files.imports import is_session

    if is_session(path) or path.suffix.lower() != ".npz":
        return {}
    arrays = load_arrays(path)
    if "flags" in arrays and arrays["flags"].dtype.kind not in "biuf":
        raise DataError(f"expected numbers in flags, got {arrays['flags'].dtype}", where=str(path))
    return arrays


_HARDLY = 0.5


def calibrate_class(
    recording: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="Frames; some have a label with their class."),
        Reads(),
    ],
    out: CalibrationOut,
    skin: KnownSkinOption = None,
    label: Annotated[
        list[str] | None,
        typer.Option(
            "--class",
            metavar="NAME=A:B",
            help="Label: frames A to B-1 show this class. Can be repeated. Default: class or "
            "flags of the file.",
        ),
    ] = None,
    onto: Annotated[
        Path | None,
        typer.Option(
            metavar="OLD.npz",
            help="Calibration of another session. These frames, labelled or not, align it to "
            "this one.",
        ),
        Reads(),
    ] = None,
    reference: ReferenceOption = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Learn the class of a frame, or flags, from a few examples of each."""
    from tomoskin.cli.calibrate_class import marked
    from tomoskin.files.imports import read_recording
    from tomoskin.learning import CLASSES
    from tomoskin.model.pattern import Pattern

    data = read_recording(recording)
    say_notes(data)
    with Bar("learning from the older calibration"):
        old = CLASSES.read(onto) if onto else None
    chosen, pattern = _what_of(skin, recording, old)
    pattern = pattern or Pattern.from_tables(data.drive, data.measure)
    data = data.in_order_of(pattern)
    dv = changes(data, reference, pattern)
    examples = marked(
        recording, dv, label or [], old.model.classifier.examples.codes if old else None
    )
    with Bar("learning"):
        made = _learnt(examples, old, pattern, chosen)
    made.write(out, overwrite=force)
    _report(made, len(dv), old is not None, json=json)


def _what_of(
    name: str | None, path: Path, old: Calibration[FrameClassifier] | None
) -> tuple[Skin | None, Pattern | None]:
    """The skin, where there is one, and the table of rows where it is known before."""
    from tomoskin.cli.choices import skin_if_any

    skin = skin_if_any(name, path)
    if old is not None:
        if skin is not None:
            old.check_skin(skin)
        return skin, old.pattern
    return skin, skin.pattern() if skin else None


def _learnt(
    examples: Examples,
    old: Calibration[FrameClassifier] | None,
    pattern: Pattern,
    skin: Skin | None,
) -> Calibration[FrameClassifier]:
    from tomoskin.learning import CLASSES, Classifier, FrameClassifier

    if old is not None:
        fitted = old.model.classifier.in_session(examples.dv, examples.flags)
        return old.with_model(FrameClassifier.of(fitted))
    identities = pattern.identity, skin.identity if skin else ""
    classifier = Classifier.learn(examples, identities)
    return CLASSES.of(FrameClassifier.of(classifier), pattern, skin)


def _report(made: Calibration[FrameClassifier], n_frames: int, fitted: bool, *, json: bool) -> None:
    classifier = made.model.classifier
    examples, codes = classifier.examples, classifier.examples.codes
    here = examples.part(examples.newest)
    n_labelled = int(here.labelled.sum())
    if json:
        emit(
            {
                "names": codes.names,
                "exclusive": codes.exclusive,
                "frames": n_frames,
                "labelled": n_labelled,
                "sessions": int(examples.session.max()) + 1,
                "right_when_left_out": classifier.right,
                "alignment": _alignment(classifier.alignment),
            }
        )
        return
    kind = "classes" if codes.exclusive else "flags"
    typer.echo(f"{len(codes.names)} {kind}: {', '.join(codes.names)}")
    share = f"{100 * classifier.right:.0f} % of the labelled frames"
    typer.echo(
        f"{n_labelled} of {n_frames} frames labelled; in cross-validation, {share} are right"
    )
    if classifier.right < _HARDLY:
        typer.echo("the labels hardly depend on the data: check that they belong to these frames")
    if fitted and classifier.alignment is not None:
        typer.echo(classifier.alignment.text)


def _alignment(alignment: Alignment | None) -> dict[str, object] | None:
    if alignment is None:
        return None
    return {
        "holds": alignment.holds,
        "reliability": alignment.reliability,
        "grown": alignment.grown,
        "reasons": list(alignment.reasons),
    }
