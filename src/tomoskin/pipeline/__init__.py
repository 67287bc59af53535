"""The one frame flow, pure: a reference is collected, then frames are followed to touches."""

from tomoskin.pipeline.drives import DriveResult
from tomoskin.pipeline.electrode_order import order_fault
from tomoskin.pipeline.finding import located_alone, voltage_covariance
from tomoskin.pipeline.following import Setting
from tomoskin.pipeline.frame_result import FrameResult, ModelAgreement, ReferenceState
from tomoskin.pipeline.guess import guess_skin
from tomoskin.pipeline.imaging import Unresolved
from tomoskin.pipeline.offline import ALONE, Gathered, Reconstruction, reconstruct
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES, Pipeline
from tomoskin.pipeline.prepare import Prepared, colour_limit, prepare, with_calibrations
from tomoskin.pipeline.recorded import Idle, recorded_frames
from tomoskin.pipeline.rest import tuned, tuned_by_rule, tuned_image, with_choice
from tomoskin.pipeline.sharp import sharpened

__all__ = [
    "ALONE",
    "REFERENCE_FRAMES",
    "DriveResult",
    "FrameResult",
    "Gathered",
    "Idle",
    "ModelAgreement",
    "Pipeline",
    "Prepared",
    "Reconstruction",
    "ReferenceState",
    "Setting",
    "Unresolved",
    "colour_limit",
    "guess_skin",
    "located_alone",
    "order_fault",
    "prepare",
    "reconstruct",
    "recorded_frames",
    "sharpened",
    "tuned",
    "tuned_by_rule",
    "tuned_image",
    "voltage_covariance",
    "with_calibrations",
    "with_choice",
]
