"""The kind of calibration that tells which class a frame belongs to, from labelled examples.

Keys of the .npz: ``kind``, ``version``; ``dv`` (n, n_meas), ``flags`` (n, f) 0 or 1, NaN where a
frame has no label, ``session`` (n,) from 0; ``names`` (f,), ``exclusive`` 0 or 1; ``drive``,
``measure`` (n_meas, 2), ``n_electrodes``; ``skin`` identity, ``skin_name``. As with touch, what was
learnt is learnt again when the file is read.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from tomoskin.core import (
    Arrays,
    DataError,
    Detection,
    FloatArray,
    IntArray,
    real_numbers,
    whole_number,
)
from tomoskin.learning.classes.classifier import Classifier
from tomoskin.learning.classes.examples import Codes, Examples
from tomoskin.learning.kind import Applied, Conditions, FrameView, Kind, Progress, located
from tomoskin.model.pattern import Pattern


@dataclass(frozen=True, slots=True)
class ClassReading:
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

    name: str
    probability: float
    unknown: bool

    @property
    def text(self) -> str:
        """For people."""
        if self.unknown:
            return f"unknown class (nearest: {self.name})"
        return f"{self.name} {100 * self.probability:.0f} %"


@dataclass(frozen=True, eq=False)
class FrameClassifier:
    """A classifier for the frames of one skin, of which some measurements may be missing.

    Attributes
    ----------
    classifier
        What was learnt, of all measurements.
    rows
        (n_meas,) the classifier's measurement of each one of a frame.
    """

    classifier: Classifier
    rows: IntArray

    @classmethod
    def of(cls, classifier: Classifier) -> Self:
        """With all measurements."""
        return cls(classifier, np.arange(classifier.examples.dv.shape[1]))

    def without(self, measurements: IntArray) -> FrameClassifier:
        """For frames that lack ``measurements``."""
        return replace(self, rows=np.delete(self.rows, measurements))

    def __call__(self, change: FloatArray) -> ClassReading:
        """Of a frame minus the reference, (n_meas,) V, NaN where a measurement is excluded."""
        complete = np.full(self.classifier.examples.dv.shape[1], np.nan)
        complete[self.rows] = change
        answers = self.classifier.predict(complete[None])
        return ClassReading(
            answers.label[0], float(answers.probability[0]), bool(answers.rejected[0])
        )


class ClassesApplied(Applied):
    """Classifies each frame against the reference as it was taken: a class that lasts is not to be
    learnt as the skin's rest."""

    def __init__(self, frames: FrameClassifier) -> None:
        self._frames = frames

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> ClassReading:
        """The class of this frame."""
        del detections, touched
        return self._frames(view.differences.since_reference)


def _pack(frames: FrameClassifier) -> Arrays:
    classifier = frames.classifier
    examples = classifier.examples
    return {
        "dv": examples.dv,
        "flags": examples.flags,
        "session": examples.session,
        "names": np.array(examples.codes.names),
        "exclusive": np.array(int(examples.codes.exclusive)),
        "skin": np.array(classifier.skin_id),
    }


def _unpack(arrays: Arrays, pattern: Pattern, where: str, _progress: Progress) -> FrameClassifier:
    with located(where):
        examples = _examples(arrays, where)
        if examples.dv.shape[1] != pattern.n_meas:
            raise DataError(f"expected {pattern.n_meas} rows of dv, got {examples.dv.shape[1]}")
        identities = (pattern.identity, str(arrays.get("skin", "")))
        return FrameClassifier.of(Classifier.learn(examples, identities))


def _examples(arrays: Arrays, where: str) -> Examples:
    exclusive = bool(whole_number(arrays, "exclusive", where))
    codes = Codes(tuple(map(str, arrays["names"].ravel().tolist())), exclusive)
    examples = Examples.of(
        codes, real_numbers(arrays, "dv", where), real_numbers(arrays, "flags", where)
    )
    session = real_numbers(arrays, "session", where)
    if session.shape != (len(examples),) or not np.isin(session, range(1000)).all():
        raise DataError(
            f"expected a session from 0 to 999 for each of {len(examples)} frames, "
            f"got shape {session.shape}"
        )
    return replace(examples, session=session.astype(np.int64))


def _apply(frames: FrameClassifier, _conditions: Conditions) -> Applied:
    return ClassesApplied(frames)


CLASSES = Kind(
    name="class",
    title="tomoskin states calibration",
    version=1,
    subject="classes",
    command="class",
    attachment="states.npz",
    keys=frozenset({"dv", "flags", "session", "names", "exclusive"}),
    pack=_pack,
    unpack=_unpack,
    exclude=FrameClassifier.without,
    apply=_apply,
    skin_id=lambda frames: frames.classifier.skin_id,
    own_settings=True,
)
"""Classes of frames; its model is a :class:`FrameClassifier`."""
