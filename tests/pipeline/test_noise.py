"""No touch on an untouched skin, whatever its noise: some frames of benchmarks/touch_noise.py."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
FRAMES = 300


@pytest.fixture(scope="module")
def bench():
    sys.path.insert(0, str(BENCHMARKS))
    try:
        return importlib.import_module("touch_noise")
    finally:
        sys.path.remove(str(BENCHMARKS))


@pytest.fixture(scope="module")
def fitted(bench):
    return bench.fitted("textile-disc-8")


@pytest.mark.parametrize("case", range(7))
def test_no_false_touch(bench, fitted, case):
    noise = list(bench.CASES.values())[case]
    if noise.loud != 1.0:
        noise = type(noise)(loud=noise.loud, every=FRAMES // 2)
    assert bench.false_touches(fitted, noise, 41, FRAMES)[:2] == (0, 0)


def test_a_faint_touch_is_found_nearly_as_if_the_noise_were_known(bench, fitted):
    for name in ("rows independent", "hum, 3 times the noise"):
        needed = bench.least_found(fitted, bench.CASES[name], 41, 200)
        assert np.median(needed) < 1.05
        assert needed.max() < 1.2
