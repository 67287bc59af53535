"""The classifier, examples → which class a frame shows, how sure, or none of them; and the kind of
calibration that it makes."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tomoskin.core import DataError, Detection, FloatArray, IntArray
from tomoskin.extras.classes.examples import Codes, Examples
from tomoskin.extras.classes.held_out import HeldOut, compared, learnt, runs_of, tempered
from tomoskin.extras.classes.mixture import (
    Alignment,
    Mixture,
    Subspace,
    aligned,
    posterior,
    session_mean,
    shows,
)
from tomoskin.learning import (
    Applied,
    Conditions,
    FrameView,
    Kind,
    Reading,
    ShownReading,
    frames,
)
from tomoskin.model.pattern import Pattern

_ENOUGH = 10
"""Unlabelled frames of a session below which it is not fitted."""


@dataclass(frozen=True, eq=False)
class Answers:
    """What frames show.

    ``flags`` (n, f) 0 or 1; ``label`` in words; ``probability`` (n,) of that combination, of
    ``each`` flag or state (n, f); ``rejected`` (n,) frames that look like none of them.
    """

    flags: FloatArray
    label: tuple[str, ...]
    probability: FloatArray
    each: FloatArray
    rejected: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class ClassReading(Reading):
    """What one frame shows.

    Attributes
    ----------
    name
        The class, or the flags that are set; the nearest where it is ``unknown``.
    probability
        Of that class among those that were learnt.
    unknown
        Whether the frame looks like none of them.
    """

    key: ClassVar[str] = "class"
    listed: ClassVar[str] = "classes"
    name: str
    probability: float
    unknown: bool

    @property
    def word(self) -> str:
        """The class, or that it is none."""
        return "unknown" if self.unknown else self.name

    @property
    def facts(self) -> dict[str, Any]:
        """The class, and how sure it is."""
        return asdict(self)

    @property
    def shown(self) -> ShownReading:
        """One line above the touches."""
        if self.unknown:
            words = f"Class unknown (nearest: {self.name})"
        else:
            words = f"Class: {self.name}, {100 * self.probability:.0f} %"
        return ShownReading(words, words, "touches")

    @property
    def text(self) -> str:
        """The class as the terminal shows it."""
        if self.unknown:
            return f"unknown class (nearest: {self.name})"
        return f"{self.name} {100 * self.probability:.0f} %"


@dataclass(frozen=True, eq=False)
class Classifier:
    """States or flags of frames, learnt from examples; made by :meth:`fit`.

    Attributes
    ----------
    examples
        What it was learnt from, session by session; answers are for the newest.
    skin_id
        Identity of the skin, "" where it is not known.
    right
        Part of the labelled frames of the newest session that has them all whose class is right
        when their repetition is left out of the learning.
    noticed
        Part of them that would be called unknown had their class not been taught; NaN for flags.
    alignment
        How the newest session was taken over; None where it has all its labels.
    rows
        (n_meas,) of the examples' measurements, each one's number in a frame, where frames lack
        some; None where they have all.
    """

    examples: Examples
    skin_id: str
    subspace: Subspace
    mixture: Mixture
    sharpness: float
    limit: float
    right: float
    noticed: float = math.nan
    alignment: Alignment | None = None
    rows: IntArray | None = None

    @classmethod
    def fit(
        cls,
        dv: ArrayLike,
        labels: ArrayLike,
        *,
        names: tuple[str, ...] = (),
        pattern: Pattern | None = None,
        skin_id: str = "",
    ) -> Self:
        """Learn from frames (n, n_meas) minus untouched frames, in any one unit.

        Parameters
        ----------
        labels
            (n,) names of classes of which one holds, or (n, f) flags 0 or 1 of which any may.
        names
            Of the flags; by default 1, 2, ….
        pattern, skin_id
            What was measured, and on which skin.

        Raises
        ------
        DataError
            For arrays that do not belong together, and too few examples of a state.
        """
        given = np.asarray(labels)
        if given.ndim == 1:
            codes = Codes.of_labels(given.tolist())
            flags = codes.flags_of(given.tolist())
        else:
            count = given.shape[1] if given.ndim == 2 else 0
            codes = Codes(names or tuple(map(str, range(1, count + 1))), exclusive=False)
            flags = given.astype(np.float64)
        if pattern is not None:
            frames(dv, pattern.n_meas)
        return cls.learn(Examples.checked(codes, dv, flags), skin_id)

    @classmethod
    def learn(cls, examples: Examples, skin_id: str = "") -> Self:
        """Learn from checked examples of the skin of that identity."""
        chosen, codes = examples.to_teach, examples.codes
        taught = examples.part(chosen).enough()
        held_out = HeldOut.of(taught, runs_of(examples)[chosen])
        subspace = Subspace.of(examples)
        made = cls(
            examples,
            skin_id,
            subspace,
            learnt(subspace, taught, examples, held_out.covariance(subspace)),
            sharpness=held_out.sharpness,
            limit=held_out.limit,
            right=held_out.right,
            noticed=held_out.noticed(subspace.axes.shape[1]) if codes.exclusive else math.nan,
        )
        complete = examples.labelled[examples.newest].all()
        return made if complete else made._settled(held_out.strange)

    def _settled(self, usual: FloatArray) -> Self:
        """Fitted to the newest session, not all of whose frames have a label."""
        newest = self.examples.part(self.examples.newest)
        x = self.subspace.whitened(newest.dv) @ self.subspace.axes
        numbers = self.examples.codes.numbers(newest.flags)
        older = self.examples.part(~self.examples.newest)
        if len(x) < _ENOUGH or not older.labelled.any():
            return self._with(self.mixture.adapted(x, numbers), newest.dv, usual)
        fitted, alignment = aligned(self.mixture, x, numbers, self._rest())
        made = self._with(fitted, newest.dv, usual)
        if alignment.holds:
            sharpness = min(self.sharpness, tempered(fitted.distances(x), alignment.reliability))
            return replace(made, sharpness=sharpness, alignment=alignment)
        before = type(self).learn(older, self.skin_id)
        return replace(before, examples=self.examples, alignment=alignment)

    def _with(self, mixture: Mixture, dv: FloatArray, usual: FloatArray) -> Self:
        """With a mixture fitted to frames (n, n_meas); ``usual`` (m,) strangeness of known ones."""
        strange = compared(self.subspace, mixture, dv)[1]
        limit = self.limit * max(float(np.median(strange) / np.median(usual)), 1.0)
        return replace(self, mixture=mixture, limit=limit)

    def _rest(self) -> FloatArray | None:
        """(1, d) an untouched frame of the newest session; None where that has had flags set."""
        zeros = np.zeros((1, self.examples.dv.shape[1]))
        if self.examples.codes.exclusive:
            return None
        taught = self.examples.part(self.examples.to_teach)
        for number in np.unique(taught.session):
            middle = session_mean(self.examples.dv[self.examples.session == number])
            group = np.zeros(int((taught.session == number).sum()), dtype=np.int64)
            x = self.subspace.whitened(taught.dv[taught.session == number], middle)
            flags = taught.flags[taught.session == number]
            mixture = Mixture.of(self.mixture.table, x @ self.subspace.axes, flags, group)
            if shows(mixture, self.subspace.whitened(zeros, middle) @ self.subspace.axes):
                return None
        return np.asarray(self.subspace.whitened(zeros) @ self.subspace.axes)

    def predict(self, dv: ArrayLike) -> Answers:
        """What frames (n, n_meas) show; values that are not finite are left out.

        Raises DataError for another number of rows.
        """
        codes = self.examples.codes
        data = frames(dv, self.examples.dv.shape[1])
        distances, strange = compared(self.subspace, self.mixture, data)
        lost = self.alignment is not None and not self.alignment.holds
        weights = posterior(distances, 0.0 if lost else self.sharpness)
        best = distances.argmin(axis=1)
        empty = ~np.isfinite(data).any(axis=1)
        return Answers(
            codes.table[best],
            tuple(codes.text(int(number)) for number in best),
            weights.max(axis=1),
            weights @ codes.table,
            (strange > self.limit) | empty | lost,
        )

    def in_session(self, dv: ArrayLike, flags: ArrayLike | None = None) -> Self:
        """Classifier for a new session, from its frames (n, n_meas), labelled or not.

        ``flags`` (n, f) as far as they are known, rows of NaN otherwise. The frames should show
        the classes as they come: which ones they show is found while the rest is fitted. Where
        that cannot be believed (:attr:`alignment`), the classifier stays as it was and calls the
        session's frames unknown. Raises DataError as :meth:`fit`, and for fewer than ten frames
        without a label.
        """
        codes = self.examples.codes
        data = frames(dv, self.examples.dv.shape[1])
        unknown = np.full((len(data), len(codes.names)), np.nan)
        more = Examples.checked(codes, data, unknown if flags is None else flags)
        if not more.labelled.any() and len(more) < _ENOUGH:
            raise DataError(f"expected at least {_ENOUGH} frames of the session, got {len(more)}")
        return self.learn(self.examples.and_then(more), self.skin_id)

    def without(self, measurements: IntArray) -> Self:
        """The same for frames that lack ``measurements``."""
        rows = np.arange(self.examples.dv.shape[1]) if self.rows is None else self.rows
        return replace(self, rows=np.delete(rows, measurements))

    def read(self, change: FloatArray) -> ClassReading:
        """The class of a frame minus the reference, (n_meas,) V, NaN where one is excluded."""
        complete = np.full(self.examples.dv.shape[1], np.nan)
        complete[slice(None) if self.rows is None else self.rows] = change
        answers = self.predict(complete[None])
        return ClassReading(
            answers.label[0], float(answers.probability[0]), bool(answers.rejected[0])
        )


class ClassesApplied(Applied):
    """Classifies each frame against the reference as it was taken: a class that lasts is not to be
    learnt as the skin's rest."""

    def __init__(self, classifier: Classifier, _conditions: Conditions) -> None:
        self._classifier = classifier

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> ClassReading:
        """Read the class of this frame from its change since the reference."""
        del detections, touched
        return self._classifier.read(view.differences.since_reference)


CLASSES: Kind[Classifier] = Kind(
    name="class",
    title="tomoskin states calibration",
    subject="classes",
    attachment="states.npz",
    learn=Classifier.learn,
    exclude=Classifier.without,
    apply=ClassesApplied,
    reading=ClassReading,
    own_settings=True,
)
"""Classes of frames; its model is a :class:`Classifier`."""
