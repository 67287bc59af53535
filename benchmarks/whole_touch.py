"""Places of touches on the twin: fitted to the voltages, and learnt from labelled presses."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.interpolate import RBFInterpolator

import frame
from tomoskin import Locator, Skin
from tomoskin.core import FloatArray
from tomoskin.files.imports import read_recording
from tomoskin.pipeline import prepare
from tomoskin.run import in_this_process, make_set
from tomoskin.twin import COMMON_PRESSES, SetPlan
from whole_line import Line

SKIN, PRESET, SEED = "textile-disc-16", "textile", 1
LEARNT, TESTED = 200, 200
SMOOTHING = 1.0
"""Of the radial basis functions, on rows of unit deviation; 0.1 and 10 are no better."""


def touch_lines() -> Iterator[Line]:
    """Time of both, and how far off the learnt places are."""
    skin = Skin.load(SKIN)
    fitted = prepare(skin.altered({"touch": {"method": "fit"}}))
    yield Line("two touches fitted to the voltages, p50", "ms a frame", frame.p50(fitted, 2))
    dv, xy = _presses(skin)
    began = time.process_time()
    locator = Locator.fit(dv[:LEARNT], xy[:LEARNT], skin=skin)
    learning = time.process_time() - began
    began = time.process_time()
    places = np.concatenate([locator.predict(row[None])[0] for row in dv[LEARNT:]])
    each = 1e3 * (time.process_time() - began) / TESTED
    plain, plain_learning = _plain(dv, xy)
    off, plain_off = (_error(p, xy[LEARNT:]) for p in (places, plain))
    yield Line(f"learning from {LEARNT} labelled presses", "s", learning, "< 2", plain_learning)
    yield Line("place of a frame by it", "ms", each, "< 1")
    yield Line(f"error of {TESTED} other places, median", "mm", off, scipy=plain_off)


def _presses(skin: Skin) -> tuple[FloatArray, FloatArray]:
    """(n, n_meas) V, (n, 2) m."""
    plan = SetPlan(skin.to_toml(), COMMON_PRESSES, PRESET, SEED, LEARNT + TESTED)
    with TemporaryDirectory() as folder:
        file = Path(folder) / "presses.npz"
        make_set(plan, file, in_this_process, lambda _done, _total: None)
        recording = read_recording(file)
    assert recording.labels is not None
    assert recording.reference is not None
    ordered = recording.in_order_of(skin.pattern())
    return ordered.voltages - ordered.reference, recording.labels


def _plain(dv: FloatArray, xy: FloatArray) -> tuple[FloatArray, float]:
    """(n, 2) m by radial basis functions over the rows as they are, and s to make them."""
    rows = (dv - dv[:LEARNT].mean(axis=0)) / dv[:LEARNT].std(axis=0)
    began = time.process_time()
    spline = RBFInterpolator(rows[:LEARNT], xy[:LEARNT], kernel="linear", smoothing=SMOOTHING)
    took = time.process_time() - began
    return spline(rows[LEARNT:]), took


def _error(found: FloatArray, true: FloatArray) -> float:
    return 1e3 * float(np.median(np.linalg.norm(found - true, axis=1)))
