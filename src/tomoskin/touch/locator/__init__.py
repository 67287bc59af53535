"""Where a touch is, learnt from labelled presses."""

from tomoskin.touch.locator.locator import Locator
from tomoskin.touch.locator.presses import Presses
from tomoskin.touch.locator.region import Region
from tomoskin.touch.locator.review import Remark
from tomoskin.touch.locator.watch import Watch

__all__ = ["Locator", "Presses", "Region", "Remark", "Watch"]
