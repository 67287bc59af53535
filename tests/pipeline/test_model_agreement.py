"""What is said of a reference beside the skin's model."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from tomoskin.pipeline import ModelAgreement

MODEL = np.linspace(1.0, 2.0, 5)


def test_nothing_is_said_where_there_is_no_reference_yet() -> None:
    nothing = ModelAgreement()
    assert math.isnan(nothing.cosine)
    assert nothing.doubt(volts=True) is None


@pytest.mark.parametrize(
    ("reference", "said"),
    [
        (MODEL, None),
        (5 * MODEL, "at 5 times its size: check the skin, its current"),
        (0 * MODEL, "by 0.000 .* check the skin and the order of the electrodes"),
        (MODEL[::-1] * [1, -1, 1, -1, 1], "check the skin and the order of the electrodes"),
    ],
)
def test_another_shape_or_size_is_doubted(reference: np.ndarray, said: str | None) -> None:
    doubt = ModelAgreement.of(reference, MODEL).doubt(volts=True)
    if said is None:
        assert doubt is None
    else:
        assert doubt is not None
        assert re.search(said, doubt)
