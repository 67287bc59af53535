"""Where a touch is, learnt from labelled presses."""

from tomoskin.calibration.locator.left_out import LeftOut
from tomoskin.calibration.locator.locator import Locator
from tomoskin.calibration.locator.presses import Presses
from tomoskin.calibration.locator.stacking import Remark
from tomoskin.calibration.locator.watch import Watch
from tomoskin.touch import Region

__all__ = ["LeftOut", "Locator", "Presses", "Region", "Remark", "Watch"]
