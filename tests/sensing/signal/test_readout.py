"""Counts → volts in the pattern's order, and samples at a rail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, strategies as st
from numpy.typing import NDArray

from tomoskin.core import DataError, Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import ReadoutSettings, Skin
from tomoskin.sensing.signal import Readout

SETTINGS = ReadoutSettings(
    adc_bits=10,
    reference_voltage=5.0,
    gain=40.0,
    offset=0.1,
    oversampling=16,
    settling=2e-3,
    tick_rate=250e3,
)
PATTERN = Pattern.adjacent(8)
SCAN = Scan.of(PATTERN)
READOUT = Readout.of(SCAN, SETTINGS)


def frame(samples: NDArray[np.uint16]) -> Frame:
    return Frame(7, 1234, 0.5, 1, 0, 0, samples)


def middle() -> NDArray[np.uint16]:
    return np.full(SCAN.n_samples, 8000, dtype=np.uint16)


def counts(volts: NDArray[np.float64], settings: ReadoutSettings) -> NDArray[np.uint16]:
    """What a converter makes of skin potentials, rounded at each of the summed readings."""
    levels = 2**settings.adc_bits
    code = np.floor((settings.gain * volts + settings.offset) / settings.reference_voltage * levels)
    return (np.clip(code, 0, levels - 1) * settings.oversampling).astype(np.uint16)


@given(st.integers(8, 16), st.integers(0, 2**32 - 1))
def test_volts_come_back_within_a_step_of_the_converter(bits: int, seed: int) -> None:
    most = (2**16 - 1) // (2**bits - 1)
    settings = replace(SETTINGS, adc_bits=bits, oversampling=min(16, most))
    potential = np.random.default_rng(seed).uniform(0.0, 0.12, (8, 8))
    readout = Readout.of(SCAN, settings)
    samples = counts(potential[SCAN.sample_drive, SCAN.sample_electrode], settings)
    voltages = readout(frame(samples))
    plus, minus = PATTERN.measure.T
    expected = potential[PATTERN.drive_index, plus] - potential[PATTERN.drive_index, minus]
    step = settings.reference_voltage / 2**bits / settings.gain
    assert np.abs(voltages.values - expected).max() <= step * (1 + 1e-9)
    assert not voltages.excluded.any()


def test_differences_do_not_wrap_around() -> None:
    """Samples are unsigned: a smaller plus than minus must come out negative."""
    samples = middle()
    samples[SCAN.plus[0]], samples[SCAN.minus[0]] = 100, 16000
    assert READOUT(frame(samples)).values[0] == pytest.approx(-15900 * READOUT.volts_per_count)


def test_offset_leaves_with_the_difference() -> None:
    other = Readout.of(SCAN, replace(SETTINGS, offset=2.0))
    samples = np.random.default_rng(0).integers(100, 16000, SCAN.n_samples, dtype=np.uint16)
    assert np.array_equal(other(frame(samples)).values, READOUT(frame(samples)).values)


def test_frame_data_travel_along() -> None:
    voltages = READOUT(frame(middle()))
    assert (voltages.sequence, voltages.host_time) == (7, 0.5)
    assert voltages.time == 1234 / SETTINGS.tick_rate
    assert voltages.values.shape == voltages.excluded.shape == (PATTERN.n_meas,)


@pytest.mark.parametrize(
    ("count", "railed"),
    [(0, True), (16, True), (17, False), (1022 * 16 - 1, False), (1022 * 16, True), (16368, True)],
)
def test_rows_made_of_a_railed_sample_are_marked(count: int, railed: bool) -> None:
    samples = middle()
    samples[2] = count
    voltages = READOUT(frame(samples))
    made_of = (SCAN.plus == 2) | (SCAN.minus == 2)
    assert made_of.sum() == 2
    assert np.array_equal(voltages.excluded, made_of & railed)


def test_a_converter_that_fills_sixteen_bits() -> None:
    readout = Readout.of(SCAN, replace(SETTINGS, adc_bits=16, oversampling=1))
    samples = middle()
    samples[SCAN.plus[0]], samples[SCAN.minus[0]] = 65535, 0
    voltages = readout(frame(samples))
    assert voltages.values[0] == pytest.approx(65535 / 65536 * 5.0 / 40.0)
    assert voltages.excluded[0]


@pytest.mark.parametrize("n", [0, SCAN.n_samples - 1, SCAN.n_samples + 1])
def test_another_number_of_samples(n: int) -> None:
    with pytest.raises(DataError, match=f"expected 48 samples, got {n}") as caught:
        READOUT(frame(np.zeros(n, dtype=np.uint16)))
    assert caught.value.where == "frame 7"


def test_what_rounding_leaves() -> None:
    """Of a board of no noise: rounding is even within a step, 1/√12 of it, in each reading."""
    skin = Skin.load("textile-disc-8")
    readout = Readout.of(Scan.of(skin.pattern()), skin.readout)
    n = skin.readout.oversampling
    assert readout.rounding == pytest.approx(readout.volts_per_count * np.sqrt(2 * n / 12))
    assert readout.rounding < readout.noise
