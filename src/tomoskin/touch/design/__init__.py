"""What a skin can resolve before it is built."""

from tomoskin.touch.design.compare import Variant, variants
from tomoskin.touch.design.promise import Demand, Promise, promise

__all__ = ["Demand", "Promise", "Variant", "promise", "variants"]
