"""Which class each frame shows, or which flags, learnt from a few examples of each."""

from tomoskin.extras.classes.classifier import (
    CLASSES as CLASSES,
    Answers as Answers,
    Classifier as Classifier,
    ClassReading as ClassReading,
)
from tomoskin.extras.classes.examples import (
    Codes as Codes,
    Examples as Examples,
    against_rest as against_rest,
)
