"""What does not turn with the current is found per electrode, said in words, and costs no data."""

import numpy as np
import pytest

from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Monitor, Readout, Reference
from tomoskin.sensing.signal.readout import OwnVoltage

PATTERN = Pattern.adjacent(8)
SCAN = Scan.of(PATTERN)


def test_own_voltages_are_found_under_any_drive():
    rng = np.random.default_rng(4)
    per_count = 1e-5
    own = rng.normal(0, 2e-3, 8)
    common = rng.uniform(2000, 9000, 8)
    sums = np.rint(common[SCAN.sample_drive] + own[SCAN.sample_electrode] / per_count)
    found = OwnVoltage.of(SCAN, per_count, 16_000)(sums.astype(np.uint16))
    assert found == pytest.approx(own - own.mean(), abs=per_count)


def chopped(own):
    """A frame of a drive that alternates; electrodes have ``own`` (8,) V."""
    readout = Readout.of(SCAN, Skin.load("textile-disc-8").readout)
    counts = 4000.0 + own[SCAN.sample_electrode] / readout.volts_per_count
    differences = 0x8000 + 200 * (SCAN.sample_electrode % 3)
    return readout, Frame(
        0, 0, 0.0, 1, 0, 0, differences.astype(np.uint16), counts.astype(np.uint16)
    )


def test_a_large_one_is_said_in_words_and_the_electrode_is_used():
    own = np.zeros(8)
    own[4] = 20e-3
    readout, frame = chopped(own)
    reads = readout(frame)
    assert not reads.excluded.any()
    noise = np.full(PATTERN.n_meas, 1e-5)
    rest = np.where(reads.values == 0, 1e-3, reads.values)
    monitor = Monitor(
        PATTERN, Reference(rest, noise, 10), rest, unusable=np.zeros(PATTERN.n_meas, bool),
        scan=SCAN, most_own=readout.own_voltage.large,
    )  # fmt: skip
    assert readout.own_voltage.large < 20e-3
    for time in range(3):
        health = monitor.push(rest, reads.excluded, float(time), None, reads.own)
    (sick,) = health.sick
    assert (sick.electrode, sick.state) == (4, "offset")
    assert "+20.0 mV whatever the current does" in sick.text
    assert not health.lost.any()
    assert not health.floating.any()
    for time in range(30):
        health = monitor.push(rest, reads.excluded, 3.0 + time, None, np.zeros(8))
    assert health.sick == ()
