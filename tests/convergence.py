"""What errors on meshes of size h, h/2, h/4 … say about the order of a method."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tomoskin.core import FloatArray


def orders(errors: Sequence[float] | FloatArray) -> FloatArray:
    """Order between each mesh and the next."""
    return np.asarray(-np.diff(np.log2(errors)))


def check_order(errors: Sequence[float] | FloatArray, order: float, within: float = 0.12) -> None:
    """Fail unless the last two meshes show an error in proportion to h to that power."""
    assert abs(orders(errors)[-1] - order) < within, (list(errors), orders(errors))


def check_order_with_log(errors: Sequence[float], order: float, within: float = 0.3) -> None:
    """Fail unless the errors are h^order (a + b log(1/h)).

    Divided by the power they grow by the same amount from each mesh to the next.
    """
    scaled = np.asarray(errors) * 2.0 ** (order * np.arange(len(errors)))
    growth = np.diff(scaled)
    assert (growth > 0).all(), (list(errors), scaled)
    assert growth.max() < (1 + within) * growth.min(), (list(errors), growth)


def check_order_from_below(errors: Sequence[float], order: float, short: float = 0.2) -> None:
    """Fail unless the orders rise towards this one, as coarse meshes let them."""
    found = orders(errors)
    assert (np.diff(found) > 0).all(), (list(errors), found)
    assert order - short < found[-1] < order + 0.05, (list(errors), found)
