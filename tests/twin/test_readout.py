"""Amplifier and converter against their formulas."""

from dataclasses import replace

import numpy as np
import pytest

from tomoskin.board.wire import Drive
from tomoskin.core import Frame
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import ReadoutSettings
from tomoskin.sensing.signal import Readout
from tomoskin.twin import ElectronicsSettings, sample_table
from tomoskin.twin.electronics import TwinElectronics, convert

SETTINGS = ReadoutSettings(offset=0.5)
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
    assert table.drives[table.drive, 0].tolist() == [1, 1, 2, 2]
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


def rows_of(sheet, skin, board, n=600, seed=5):
    """(n, n_meas) V of an untouched sheet, as the host reads them."""
    scan = Scan.of(skin.pattern())
    drives = [
        Drive(int(a), int(b), int(mask))
        for (a, b), mask in zip(scan.drives, scan.masks, strict=True)
    ]
    table = sample_table(drives, skin.readout.oversampling)
    electronics = TwinElectronics(sheet, skin.readout, skin.current, board, seed)
    readout = Readout.of(scan, skin.readout)
    frames = (Frame(k, 0, k, 1, 0, 0, electronics.sample(table, float(k))) for k in range(n))
    return np.stack([readout(frame).values for frame in frames]), readout


def test_a_rows_noise_is_what_the_host_expects_of_the_converter(sheet, skin):
    """Two samples of so many conversions each, √(2 (0.7² + 1/12)/n) LSB; white, and Gaussian."""
    volts, readout = rows_of(sheet, skin, ElectronicsSettings())
    spread = volts.std(axis=0, ddof=1)
    assert np.sqrt((spread**2).mean()) == pytest.approx(readout.noise, rel=0.02)
    assert spread == pytest.approx(np.full(len(spread), readout.noise), rel=0.15)
    standard = (volts - volts.mean(axis=0)) / spread
    n = len(standard)
    assert np.abs((standard[1:] * standard[:-1]).mean(axis=0)).max() < 5 / np.sqrt(n)
    assert (standard**4).mean() == pytest.approx(3.0, abs=0.1)
    together = standard.T @ standard / n
    pattern = skin.pattern()
    apart = np.array([
        [not {*zip([d] * 2, a, strict=True)} & {*zip([e] * 2, b, strict=True)}
         for e, b in zip(pattern.drive_index.tolist(), pattern.measure.tolist(), strict=True)]
        for d, a in zip(pattern.drive_index.tolist(), pattern.measure.tolist(), strict=True)
    ])  # fmt: skip
    assert np.abs(together[apart]).max() < 5 / np.sqrt(n)
    beside = ~apart & ~np.eye(len(apart), dtype=bool)  # neighbours share a sample, of other sign
    assert together[beside] == pytest.approx(np.full(beside.sum(), -0.5), abs=0.2)


def test_the_noise_of_several_causes_adds_in_squares(sheet, skin):
    """Converter and mains, which at whole seconds is at the same place of its turn: no noise."""
    quiet, readout = rows_of(sheet, skin, ElectronicsSettings(noise=2.0), n=200)
    with_hum, _ = rows_of(sheet, skin, ElectronicsSettings(noise=2.0, hum=2e-4), n=200)
    expected = readout.volts_per_count * np.sqrt(2 * skin.readout.oversampling * (4 + 1 / 12))
    for volts in (quiet, with_hum):
        spread = np.sqrt((volts.std(axis=0, ddof=1) ** 2).mean())
        assert spread == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize("tau", [2.0, 20.0])
def test_contacts_forget_as_an_ornstein_uhlenbeck_process(sheet, skin, tau):
    """Correlation exp(−dt/τ) from scan to scan, and the deviation that is asked for."""
    board = ElectronicsSettings(noise=0.0, contact_sd=0.1, contact_time=tau)
    table = sample_table([Drive(1, 0, 0b100)], 1)
    fine = replace(SETTINGS, adc_bits=16)
    electronics = TwinElectronics(sheet, fine, skin.current, board, 2)
    counts = np.array([electronics.sample(table, float(k))[0] for k in range(3000)], dtype=float)
    off = counts - counts.mean()
    volts = off.std() * 5.0 / 2**16 / 40.0
    effective = 3000 * np.tanh(0.5 / tau)  # independent values among so many that are not
    assert volts == pytest.approx(0.1 * skin.current, rel=4 / np.sqrt(2 * effective))
    again = (off[1:] * off[:-1]).mean() / off.var()
    assert again == pytest.approx(np.exp(-1 / tau), abs=5 * np.sqrt((1 - np.exp(-2 / tau)) / 3000))
