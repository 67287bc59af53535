"""``tomoskin calibrate states``: learn what state a frame shows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.named_files import ForceFlag, Reads
from tomoskin.cli.options import CalibrationOut, KnownSkinOption, ReferenceOption
from tomoskin.cli.output import JsonFlag, emit
from tomoskin.cli.progress import Bar
from tomoskin.cli.recording import changes, say_notes

if TYPE_CHECKING:
    from tomoskin.calibration import Calibration, Examples, FrameClassifier
    from tomoskin.pattern import Pattern
    from tomoskin.skin import Skin

_HARDLY = 0.5


def calibrate_states(
    recording: Annotated[
        Path,
        typer.Argument(metavar="INPUT", help="Frames, with the state of some of them."),
        Reads(),
    ],
    out: CalibrationOut,
    skin: KnownSkinOption = None,
    state: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=A:B",
            help="Frames A to B-1 show this state; once for each. Without it the file's own "
            "state, or flags.",
        ),
    ] = None,
    onto: Annotated[
        Path | None,
        typer.Option(
            metavar="OLD.npz",
            help="Calibration of another session: these frames, labelled or not, fit it to this "
            "one.",
        ),
        Reads(),
    ] = None,
    reference: ReferenceOption = None,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Learn the state of a frame, or flags, from a few examples of each."""
    from tomoskin.calibration import CLASSES
    from tomoskin.cli.state_labels import marked
    from tomoskin.formats import read_recording
    from tomoskin.pattern import Pattern

    whole = read_recording(recording)
    say_notes(whole)
    with Bar("learning the older ones"):
        old = CLASSES.read(onto) if onto else None
    chosen, pattern = _what_of(skin, recording, old)
    pattern = pattern or Pattern.from_tables(whole.drive, whole.measure)
    whole = whole.in_order_of(pattern)
    dv = changes(whole, reference, pattern)
    examples = marked(
        recording, dv, state or [], old.model.classifier.examples.codes if old else None
    )
    with Bar("learning"):
        made = _learnt(examples, old, pattern, chosen)
    made.write(out, overwrite=force)
    _report(made, len(dv), old is not None, json=json)


def _what_of(
    name: str | None, path: Path, old: Calibration[FrameClassifier] | None
) -> tuple[Skin | None, Pattern | None]:
    """The skin, where there is one, and the table of rows where it is known beforehand."""
    from tomoskin.cli.choices import known_skin

    skin = known_skin(name, path)
    if old is not None:
        old.model.classifier.check(skin_id=skin.identity if skin else "")
        return skin, old.pattern
    return skin, skin.pattern() if skin else None


def _learnt(
    examples: Examples,
    old: Calibration[FrameClassifier] | None,
    pattern: Pattern,
    skin: Skin | None,
) -> Calibration[FrameClassifier]:
    from tomoskin.calibration import CLASSES, Classifier, FrameClassifier

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
    known = int(here.labelled.sum())
    if json:
        emit(
            {
                "names": codes.names,
                "exclusive": codes.exclusive,
                "frames": n_frames,
                "labelled": known,
                "sessions": int(examples.session.max()) + 1,
                "right_when_left_out": classifier.right,
            }
        )
        return
    kind = "states" if codes.exclusive else "flags"
    typer.echo(f"{len(codes.names)} {kind}: {', '.join(codes.names)}")
    told = f"{100 * classifier.right:.0f} % of the labelled frames"
    typer.echo(f"{known} of {n_frames} frames labelled; left out of the learning, {told} are right")
    if classifier.right < _HARDLY:
        typer.echo("the labels hardly follow from the data: are they of these frames?")
    if fitted and known < n_frames:
        typer.echo(f"fitted to this session by {n_frames - known} frames without a label")
