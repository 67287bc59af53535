"""A body that moves under the skin: its state, separated from touches, learnt from a motion."""

from tomoskin.extras.body.body_model import BodyExamples as BodyExamples, BodyModel as BodyModel
from tomoskin.extras.body.body_reader import (
    BODY as BODY,
    BodyReader as BodyReader,
    BodyReading as BodyReading,
)
