"""``tomoskin calibrate class``: what frames are examples of, and what came of learning it."""

from __future__ import annotations

from dataclasses import asdict
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from tomoskin.cli import (
    Bar,
    KnownSkinOption,
    LearningOutcome,
    Reads,
    Recorded,
    calibration_command,
    labelled_arrays,
    labels_of_frames,
)
from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from tomoskin.extras.classes.classifier import Classifier
    from tomoskin.extras.classes.examples import Codes, Examples

_HARDLY = 0.5
"""Part of the labelled frames that are right, below which labels hardly depend on the data."""


@calibration_command("Frames; some have a label with their class.", KnownSkinOption)
def classes(
    labelled: Recorded,
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
) -> LearningOutcome:
    """Learn the class of a frame, or flags, from a few examples of each."""
    from tomoskin.extras.classes.classifier import CLASSES, Classifier

    with Bar("learning from the older calibration"):
        old = CLASSES.read(onto) if onto else None
    given = labelled.onto(old)
    codes = old.model.examples.codes if old else None
    examples = _examples(given.path, given.dv, label, codes)
    with Bar("learning"):
        if old is None:
            skin_id = given.skin.identity if given.skin else ""
            made = CLASSES.of(Classifier.learn(examples, skin_id), given.pattern, given.skin)
        else:
            made = old.with_model(old.model.in_session(examples.dv, examples.flags))
    facts = _facts(made.model, len(given.dv))
    return LearningOutcome(made.write, facts, _lines(made.model, facts, is_aligned=old is not None))


def _examples(path: Path, dv: FloatArray, given: list[str] | None, codes: Codes | None) -> Examples:
    """Examples of the frames ``dv`` (n, n_meas) of a file; ``codes`` where they are known before.

    Raises
    ------
    DataError
        When nothing says what the frames show (and ``codes`` are not known), or it is no label.
    """
    from tomoskin.core import real_numbers
    from tomoskin.extras.classes.examples import Codes, Examples

    arrays = {} if given else labelled_arrays(path)
    if "flags" in arrays:
        flags = real_numbers(arrays, "flags", str(path))
        count = flags.shape[1] if flags.ndim == 2 else 0
        names = arrays.get("flag_names", np.arange(1, count + 1)).ravel().tolist()
        own = Codes(tuple(map(str, names)), exclusive=False)
        return Examples.checked(codes or own, dv, flags)
    if given or "class" in arrays:
        labels = (
            labels_of_frames(given, len(dv), "--class", "NAME")
            if given
            else [str(s) for s in arrays["class"].tolist()]
        )
        codes = codes or Codes.of_labels(labels)
        return Examples.checked(codes, dv, codes.flags_of(labels))
    if codes is None:
        raise DataError(
            "holds no classes: expected class (n_frames,) or flags (n_frames, f)",
            where=str(path),
            hint="add one of them, or --class idle=0:40 --class touch=40:80",
        )
    return Examples.checked(codes, dv, np.full((len(dv), len(codes.names)), np.nan))


def _facts(classifier: Classifier, n_frames: int) -> dict[str, Any]:
    """Names, how many frames, and how well left-out ones are classified."""
    examples, alignment = classifier.examples, classifier.alignment
    return {
        "names": examples.codes.names,
        "exclusive": examples.codes.exclusive,
        "frames": n_frames,
        "labelled": int(examples.part(examples.newest).labelled.sum()),
        "sessions": int(examples.session.max()) + 1,
        "right_when_left_out": classifier.right,
        "unknown_when_not_taught": None if isnan(classifier.noticed) else classifier.noticed,
        "alignment": None if alignment is None else asdict(alignment),
    }


def _lines(classifier: Classifier, facts: dict[str, Any], *, is_aligned: bool) -> list[str]:
    """What :func:`_facts` gave, in sentences."""
    kind = "classes" if facts["exclusive"] else "flags"
    lines = [
        f"{len(facts['names'])} {kind}: {', '.join(facts['names'])}",
        f"{facts['labelled']} of {facts['frames']} frames labelled; with whole repetitions left "
        f"out, {100 * classifier.right:.0f} % of the labelled frames are right",
    ]
    if not isnan(classifier.noticed):
        lines.append(
            f"one known frame in twenty is called unknown, and about "
            f"{100 * classifier.noticed:.0f} % of the frames of a class that was not taught"
        )
    if classifier.right < _HARDLY:
        lines.append("the labels hardly depend on the data: check that they belong to these frames")
    if is_aligned and classifier.alignment is not None:
        lines.append(classifier.alignment.text)
    return lines
