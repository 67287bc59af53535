"""Where a touch is, learnt from labelled presses."""

from tomoskin.learning.touch.health import LeftOut
from tomoskin.learning.touch.locator import Locator
from tomoskin.learning.touch.presses import Presses
from tomoskin.learning.touch.stacking import Remark
from tomoskin.learning.touch.watch import Watch
from tomoskin.sensing.segment import Region

__all__ = ["LeftOut", "Locator", "Presses", "Region", "Remark", "Watch"]
