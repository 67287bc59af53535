"""The one frame flow, pure: a reference is collected, then frames are followed to touches."""

from tomoskin.pipeline.changes import DOUBTED, Changes, Idle, changes_of
from tomoskin.pipeline.finding import voltage_covariance
from tomoskin.pipeline.offline import Reconstruction, reconstruct
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES, Pipeline
from tomoskin.pipeline.prepare import Prepared, prepare, prepare_again, same_body
from tomoskin.pipeline.result import ReferenceState, Result
from tomoskin.pipeline.scale import colour_limit
from tomoskin.pipeline.tune import tuned

__all__ = [
    "DOUBTED",
    "REFERENCE_FRAMES",
    "Changes",
    "Idle",
    "Pipeline",
    "Prepared",
    "Reconstruction",
    "ReferenceState",
    "Result",
    "changes_of",
    "colour_limit",
    "prepare",
    "prepare_again",
    "reconstruct",
    "same_body",
    "tuned",
    "voltage_covariance",
]
