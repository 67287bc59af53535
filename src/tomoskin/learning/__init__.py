"""What is learnt from examples: positions, forces and depths, mapping; and kinds of more."""

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
from tomoskin.learning.kind import (
    Applied as Applied,
    Calibration as Calibration,
    Conditions as Conditions,
    Differences as Differences,
    FrameView as FrameView,
    Kind as Kind,
    Progress as Progress,
    Reading as Reading,
    ShownReading as ShownReading,
    TouchFit as TouchFit,
    silent as silent,
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
from tomoskin.learning.scale import (
    label_unit_doubt as label_unit_doubt,
    scale_doubt as scale_doubt,
)
from tomoskin.learning.touch.calibration_health import (
    CalibrationHealth as CalibrationHealth,
    LeftOut as LeftOut,
    growth_of_errors as growth_of_errors,
    label_doubts as label_doubts,
    worse as worse,
)
from tomoskin.learning.touch.fit_trial import FitTrial as FitTrial
from tomoskin.learning.touch.gaussian_process import (
    Basis as Basis,
    Likeness as Likeness,
    leading as leading,
    moments as moments,
    nearness as nearness,
    squared_distances as squared_distances,
    telling as telling,
)
from tomoskin.learning.touch.held_presses import HeldPresses as HeldPresses
from tomoskin.learning.touch.located_touch import TOUCH as TOUCH
from tomoskin.learning.touch.locator import Locator as Locator, detection_at as detection_at
from tomoskin.learning.touch.model_fit import compared as compared
from tomoskin.learning.touch.posterior import BoolArray as BoolArray
from tomoskin.learning.touch.presses import (
    Features as Features,
    Presses as Presses,
    frames as frames,
    labelled_touches as labelled_touches,
)
from tomoskin.learning.touch.several import Several as Several
from tomoskin.learning.touch.watch import Watch as Watch
