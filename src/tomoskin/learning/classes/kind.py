"""The kind of calibration that tells which class a frame belongs to, from labelled examples."""

from __future__ import annotations

from tomoskin.core import Detection
from tomoskin.learning.classes.classifier import Classifier, ClassReading
from tomoskin.learning.kind import Applied, Conditions, FrameView, Kind


class ClassesApplied(Applied):
    """Classifies each frame against the reference as it was taken: a class that lasts is not to be
    learnt as the skin's rest."""

    def __init__(self, classifier: Classifier) -> None:
        self._classifier = classifier

    def read(self, view: FrameView, detections: list[Detection], *, touched: bool) -> ClassReading:
        """The class of this frame."""
        del detections, touched
        return self._classifier.read(view.differences.since_reference)


def _apply(classifier: Classifier, _conditions: Conditions) -> Applied:
    return ClassesApplied(classifier)


CLASSES: Kind[Classifier] = Kind(
    name="class",
    title="tomoskin states calibration",
    subject="classes",
    attachment="states.npz",
    learn=Classifier.learn,
    exclude=Classifier.without,
    apply=_apply,
    own_settings=True,
)
"""Classes of frames; its model is a :class:`Classifier`."""
