"""The one frame flow, pure: a reference is collected, then frames are followed to touches."""

from tomoskin.pipeline.diagnosis import Cause as Cause, Diagnosis as Diagnosis
from tomoskin.pipeline.drives import DriveResult as DriveResult
from tomoskin.pipeline.finding import (
    fit_conditions as fit_conditions,
    located_alone as located_alone,
    voltage_covariance as voltage_covariance,
)
from tomoskin.pipeline.following import Setting as Setting
from tomoskin.pipeline.frame_result import (
    DOUBTED as DOUBTED,
    FrameResult as FrameResult,
    ModelAgreement as ModelAgreement,
    ReferenceState as ReferenceState,
)
from tomoskin.pipeline.imaging import Unresolved as Unresolved
from tomoskin.pipeline.offline import (
    ALONE as ALONE,
    Gathered as Gathered,
    Reconstruction as Reconstruction,
    reconstruct as reconstruct,
)
from tomoskin.pipeline.pipeline import REFERENCE_FRAMES as REFERENCE_FRAMES, Pipeline as Pipeline
from tomoskin.pipeline.prepare import (
    Prepared as Prepared,
    ambiguity_of as ambiguity_of,
    colour_limit as colour_limit,
    prepare as prepare,
    with_calibrations as with_calibrations,
)
from tomoskin.pipeline.recorded import Idle as Idle, recorded_frames as recorded_frames
from tomoskin.pipeline.rest import (
    tuned as tuned,
    tuned_by_rule as tuned_by_rule,
    tuned_image as tuned_image,
    with_choice as with_choice,
)
