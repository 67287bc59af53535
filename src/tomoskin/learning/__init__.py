"""What is learnt from examples: positions, forces and depths, classes, bends, mapping."""

from tomoskin.learning.amount.amount_model import (
    DEPTH as DEPTH,
    FORCE as FORCE,
    AmountModel as AmountModel,
    least_known as least_known,
    report_of as report_of,
)
from tomoskin.learning.amount.amount_process import AmountProcess as AmountProcess
from tomoskin.learning.amount.dent_map import DentMap as DentMap, dent_map as dent_map
from tomoskin.learning.amount.measurand import (
    FEWEST_LABELS as FEWEST_LABELS,
    MEASURED as MEASURED,
    AmountLabel as AmountLabel,
    LabelledPresses as LabelledPresses,
    Measurand as Measurand,
)
from tomoskin.learning.body.body_model import BodyExamples as BodyExamples, BodyModel as BodyModel
from tomoskin.learning.body.body_reader import (
    BODY as BODY,
    BodyReader as BodyReader,
    BodyReading as BodyReading,
)
from tomoskin.learning.classes.classifier import (
    CLASSES as CLASSES,
    Answers as Answers,
    Classifier as Classifier,
    ClassReading as ClassReading,
)
from tomoskin.learning.classes.examples import (
    Codes as Codes,
    Examples as Examples,
    against_rest as against_rest,
)
from tomoskin.learning.kind import (
    Calibration as Calibration,
    Differences as Differences,
    FrameView as FrameView,
    Kind as Kind,
    Reading as Reading,
    ShownReading as ShownReading,
    TouchFit as TouchFit,
)
from tomoskin.learning.kinds import (
    calibration_kinds as calibration_kinds,
    load_calibration as load_calibration,
)
from tomoskin.learning.mapping.mapping import ChannelMapping as ChannelMapping, ring_of as ring_of
from tomoskin.learning.mapping.solve import (
    MappingAnswer as MappingAnswer,
    solve_channel_mapping as solve_channel_mapping,
)
from tomoskin.learning.touch.calibration_health import (
    CalibrationHealth as CalibrationHealth,
    LeftOut as LeftOut,
    growth_of_errors as growth_of_errors,
    label_doubts as label_doubts,
    worse as worse,
)
from tomoskin.learning.touch.located_touch import TOUCH as TOUCH
from tomoskin.learning.touch.locator import Locator as Locator, detection_at as detection_at
from tomoskin.learning.touch.presses import Presses as Presses
from tomoskin.learning.touch.rubbing import Rubbing as Rubbing, quiet_electrodes as quiet_electrodes
from tomoskin.learning.touch.session_alignment import SessionAlignment as SessionAlignment
from tomoskin.learning.touch.several import Several as Several
from tomoskin.learning.touch.watch import Watch as Watch
