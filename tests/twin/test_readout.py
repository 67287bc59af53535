"""Amplifier and converter against their formulas."""

import numpy as np
import pytest

from tomoskin.skin import ReadoutSettings
from tomoskin.twin import ElectronicsSettings, TwinElectronics, convert, sample_table
from tomoskin.wire import Drive

SETTINGS = ReadoutSettings(10, 5.0, 40.0, 0.5, 16, 2e-3, 250e3)
LSB = 5.0 / 1024


def conversions(volts, oversampling, noise, n=4000, seed=1):
    random = np.random.default_rng(seed)
    board = ElectronicsSettings(noise=noise)
    return convert(np.full(n, volts), SETTINGS, oversampling, board, random).astype(float)


@pytest.mark.parametrize("oversampling", [1, 4, 64])
def test_mean_and_spread_follow_the_formulas(oversampling):
    counts = conversions(0.0173, oversampling, 0.7)
    exact = (40.0 * 0.0173 + 0.5) / LSB
    # Rounding down takes half a count off and adds the variance of a uniform error.
    spread = np.sqrt(oversampling * (0.7**2 + 1 / 12))
    error = spread / np.sqrt(len(counts))
    assert counts.mean() == pytest.approx(oversampling * (exact - 0.5), abs=5 * error)
    assert counts.std() == pytest.approx(spread, rel=0.06)


def test_without_noise_the_code_is_the_datasheets():
    for volts in (0.0, 0.01, 0.0999):
        code = int((40 * volts + 0.5) / 5.0 * 1024)
        assert set(conversions(volts, 1, 0.0)) == {code}
        assert set(conversions(volts, 16, 0.0)) == {16 * code}


def test_rails():
    assert set(conversions(1.0, 16, 0.7)) == {16 * 1023}
    assert set(conversions(-1.0, 16, 0.7)) == {0}


def test_samples_are_drive_major_with_channels_ascending():
    table = sample_table([Drive(1, 0, 0b1100), Drive(2, 1, 0b1001)], 4)
    assert table.source.tolist() == [1, 1, 2, 2]
    assert table.sink.tolist() == [0, 0, 1, 1]
    assert table.channel.tolist() == [2, 3, 0, 3]


def test_noise_is_fresh_in_each_scan_and_repeats_with_the_seed(sheet, skin):
    table = sample_table([Drive(1, 0, 0b11111100)], 16)

    def scans(seed):
        perfect = ElectronicsSettings()
        electronics = TwinElectronics(sheet, skin.readout, skin.current, perfect, seed)
        return [electronics.sample(table, float(k)).tolist() for k in range(3)]

    assert scans(3) == scans(3)
    assert scans(3) != scans(4)
    assert scans(3)[0] != scans(3)[1]
