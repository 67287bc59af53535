"""Where a touch is, learnt from labelled presses."""

from tomoskin.touch.locator.locator import Locator
from tomoskin.touch.locator.review import Remark

__all__ = ["Locator", "Remark"]
