"""A recording as options name it: its skin, its untouched frames, a range of it, its labels."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self

import typer

from tomoskin.cli.choices import skin_for_file, skin_if_any
from tomoskin.cli.output import Bar, remark
from tomoskin.core import DataError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from tomoskin.core import FloatArray, IntArray
    from tomoskin.files.messages import DeformationSpan
    from tomoskin.files.session import Advance
    from tomoskin.learning import Calibration
    from tomoskin.model.pattern import Pattern
    from tomoskin.model.skin import Skin
    from tomoskin.pipeline import Idle, Prepared, Reconstruction, Setting
    from tomoskin.sensing.fit import Deformation
    from tomoskin.sensing.signal import Recording, Reference
    from tomoskin.sensing.track import Span

_SHOWN = 20
"""Touches that are listed."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """A file that a command reads: the ``skin`` that it is of, where that is known; which frames
    are untouched (``reference``); the ``rows`` of an older calibration, where there is one."""

    path: Path
    recording: Recording
    skin: Skin | None
    reference: str | None
    rows: Pattern | None = None

    @classmethod
    def of(
        cls, path: Path, skin: str | None, reference: str | None, *, needs_skin: bool = False
    ) -> Self:
        """Read the file, and say what of it was left out."""
        from tomoskin.files.imports import read_recording

        recording = read_recording(path)
        say_notes(recording)
        chosen = skin_for_file(skin, path) if needs_skin else skin_if_any(skin, path)
        return cls(path, recording, chosen, reference)

    def onto(self, old: Calibration[Any] | None) -> Self:
        """The same with the rows of an older calibration, where there is one, of the same skin."""
        if old is None:
            return self
        if self.skin is not None:
            old.check_skin(self.skin)
        return replace(self, rows=old.pattern)

    @cached_property
    def pattern(self) -> Pattern:
        """The rows that are read; without a skin they are as they stand in the file."""
        from tomoskin.model.pattern import Pattern

        if self.rows is not None:
            return self.rows
        if self.skin is not None:
            return self.skin.pattern()
        if self.recording.spread:
            raise DataError(
                "has drives of several electrodes",
                where=str(self.path),
                hint="give --skin, to whose pattern they are summed",
            )
        return Pattern.from_tables(self.recording.drive, self.recording.measure)

    @property
    def drawn(self) -> Skin:
        """The skin, of a kind that needs one."""
        assert self.skin is not None
        return self.skin

    @cached_property
    def data(self) -> Recording:
        """The recording in the order of the pattern."""
        return self.recording.in_order_of(self.pattern)

    @cached_property
    def against(self) -> Idle:
        """What the frames are held against. A file that is named is read once."""
        return _idle(self.data, self.reference, self.pattern)

    @cached_property
    def idle(self) -> NDArray[Any] | Literal["previous"] | None:
        """(n_idle, n_meas) what the frames are held against; None for a file of differences."""
        idle = self.against
        return self.data.voltages[idle.start : idle.stop] if isinstance(idle, range) else idle

    @cached_property
    def dv(self) -> FloatArray:
        """(n, n_meas) frames minus the untouched skin.

        Raises DataError for complex data, or a reference that is no untouched skin.
        """
        import numpy as np

        if isinstance(self.idle, str):
            raise DataError(
                f"expected untouched frames, got {self.reference}",
                where="--reference",
                hint="give first:N or a file",
            )
        values = self.data.voltages
        if self.idle is not None:
            values = values - self.idle.mean(axis=0)
        if np.iscomplexobj(values):
            raise DataError(
                "holds complex voltages",
                where=self.data.source,
                hint="calibrate with their magnitudes instead",
            )
        return np.asarray(values, dtype=np.float64)

    @property
    def rest(self) -> Reference | None:
        """The untouched skin, where the file, or the reference, holds it."""
        from tomoskin.sensing.signal import Reference

        if self.idle is None or isinstance(self.idle, str):
            return None
        return Reference.of(self.idle.real.astype(float))

    @property
    def noise(self) -> FloatArray | None:
        """(n_meas,) V of the untouched skin; None where that is not known of every row."""
        rest = self.rest
        usable = rest is not None and rest.noise_is_known and (rest.noise > 0).all()
        return rest.noise if rest is not None and usable else None

    @property
    def labels(self) -> FloatArray:
        """(n, 2) m, NaN where a frame has no label."""
        import numpy as np

        labels = self.data.labels
        return np.full((len(self.data), 2), np.nan) if labels is None else labels

    @property
    def xy(self) -> FloatArray:
        """The labels. Raises DataError where there is none at all."""
        if not len(labelled_frames(self.labels)):
            raise DataError(
                "holds no labels: expected xy_m (n_frames, 2), the position of each press",
                where=self.data.source,
                hint="docs/touch.md shows how to make them",
            )
        return self.labels


def _idle(recording: Recording, spec: str | None, pattern: Pattern) -> Idle:
    from tomoskin.files.imports import read_recording

    if recording.is_change:
        if spec is not None:
            raise DataError(
                "holds differences, which need no reference",
                where=recording.source,
                hint="leave out --reference",
            )
        return None
    if spec == "previous":
        return "previous"
    if spec is None and recording.reference is not None:
        return recording.reference[None]
    given = f"first:{recording.idle}" if spec is None else spec
    kind, _, number = given.partition(":")
    if kind in ("first", "frame") and number.isdigit():
        return _range_of(recording, kind, int(number))
    if not given or not Path(given).exists():
        raise DataError(
            f'expected first:N, frame:K, previous or a file, got "{given}"', where="--reference"
        )
    other = read_recording(Path(given))
    if other.is_change:
        raise DataError("holds differences, not voltages of the untouched skin", where=other.source)
    return other.in_order_of(pattern).voltages


def found_touches(labelled: Recorded) -> Reconstruction:
    """The touches that the pipeline finds in each frame."""
    from tomoskin.pipeline import prepare

    with Bar("preparing"):
        prepared = prepare(labelled.drawn)
    with Bar("finding touches") as bar:
        return reconstructed(labelled, prepared, None, bar)


def reconstructed(
    given: Recorded,
    prepared: Prepared,
    frames: str | None,
    advance: Advance,
    *,
    rule: str | None = None,
    setting: Setting | None = None,
) -> Reconstruction:
    """What the pipeline makes of some ``frames`` of a file.

    A session is replayed, unless its reference is to be other than its first frames, or the skin
    has other rows than it.
    """
    from tomoskin.files.imports import is_session
    from tomoskin.files.session import SessionReader, reconstruct_session
    from tomoskin.pipeline import reconstruct, recorded_frames, tuned_by_rule, with_choice

    recording, idle, own = given.data, given.against, given.reference is None
    path, (start, stop) = Path(recording.source), frame_range(recording, frames)
    count = len(idle) if isinstance(idle, range) and not idle.start else 1
    if is_session(path) and (own or count > 1):
        with SessionReader(path) as session:
            if session.skin.pattern().identity == prepared.pattern.identity:
                if rule is not None:
                    known = recorded_frames(prepared, recording, idle)
                    choice = tuned_by_rule(known.prepared, rule, known.noise).choice
                    prepared = with_choice(prepared, choice)
                return reconstruct_session(
                    prepared,
                    session,
                    start=start,
                    stop=stop,
                    setting=setting,
                    idle=None if own else count,
                    advance=advance,
                )
    return reconstruct(
        prepared, recording, idle, start=start, stop=stop, rule=rule, setting=setting,
        advance=advance,
    )  # fmt: skip


def first_time(recording: Recording) -> float:
    """When the first frame of a file was scanned, s; those from before a session do not count."""
    from tomoskin.files.imports import is_session
    from tomoskin.files.session import SessionReader, first_scan

    path = Path(recording.source)
    if not is_session(path):
        return float(recording.time[0])
    with SessionReader(path) as session:
        return first_scan(session)


def say_notes(recording: Recording) -> None:
    """What of the file was left out, and what its times do not fit with, on stderr."""
    for note in (*recording.notes, *filter(None, [recording.leaps])):
        remark(f"{recording.source}: {note}")


def say_scale(given: Recorded, calibrations: Iterable[Calibration[Any]]) -> None:
    """Say on stderr which of them were learnt from frames in another unit than those ``given``."""
    import numpy as np

    from tomoskin.learning import scale_doubt

    known = list(calibrations)
    if not known or isinstance(given.idle, str) or np.iscomplexobj(given.data.voltages):
        return
    untouched = None if given.idle is None else given.idle.mean(axis=0)
    for one in known:
        if (doubt := scale_doubt(one, given.dv, untouched)) is not None:
            remark(f"{given.path}: {doubt}")


def span_lines(spans: Sequence[Span], unit: str = "") -> Iterator[str]:
    """Each touch in a line: when, where and how strong; the first of them."""
    for span in spans[:_SHOWN]:
        when = f"{span.begin:6.2f} to {span.end:6.2f} s"
        where = f"x {1e3 * span.x:+7.1f} mm  y {1e3 * span.y:+7.1f} mm"
        yield f"touch {span.id:>3}  {when}  {where}  strength {span.peak:+.3g} {unit}".rstrip()
    if len(spans) > _SHOWN:
        yield f"… and {len(spans) - _SHOWN} more touches"


def deformation_lines(frames: Iterable[tuple[float, Deformation | None]]) -> Iterator[str]:
    """Each deformation in (time, deformation) of frames in a line: when, and what it is."""
    from tomoskin.files.messages import deformation_spans

    spans = deformation_spans(frames)
    yield from told_deformations(spans)


def told_deformations(spans: Sequence[DeformationSpan]) -> Iterator[str]:
    """The first of them in a line each: when, and what it is."""
    for span in spans[:_SHOWN]:
        yield f"{span.begin:6.2f} to {span.end:6.2f} s  {span.deformation.text}"
    if len(spans) > _SHOWN:
        yield f"… and {len(spans) - _SHOWN} more deformations"


def _range_of(recording: Recording, kind: str, number: int) -> range:
    n = len(recording)
    if kind == "frame":
        if number >= n:
            raise DataError(
                f"expected a frame from 0 to {n - 1}, got {number}", where="--reference"
            )
        return range(number, number + 1)
    if not 1 <= number <= n:
        raise DataError(f"expected first:1 to first:{n}, got first:{number}", where="--reference")
    return range(number)


def frame_range(recording: Recording, spec: str | None) -> tuple[int, int]:
    """First frame, and one past the last; all of them without ``spec``."""
    n = len(recording)
    first, colon, last = (spec or ":").partition(":")
    if not (colon and (first or "0").isdigit() and (last or "0").isdigit()):
        raise typer.BadParameter(f'expected A:B, got "{spec}"', param_hint="--frames")
    start, stop = int(first or 0), int(last or n)
    if not 0 <= start < stop <= n:
        raise DataError(f"expected frames within 0:{n}, got {spec}", where="--frames")
    return start, stop


def labelled_frames(positions: FloatArray) -> IntArray:
    """(k,) frames of ``places`` (n, 2) that have a label."""
    import numpy as np

    return np.flatnonzero(np.isfinite(positions).all(axis=1))
