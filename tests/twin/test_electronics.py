"""The read-out's vices one by one, each against its formula."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tomoskin.board.source import ScanSettings
from tomoskin.board.wire import Drive
from tomoskin.core import ModelError
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import ReadoutSettings
from tomoskin.twin import (
    ElectronicsSettings,
    Faults,
    Press,
    ScanClock,
    TwinSettings,
    TwinSkin,
    sample_table,
)
from tomoskin.twin.electronics import TwinElectronics, convert
from tomoskin.twin.presets import BOARD

QUIET = ElectronicsSettings(noise=0.0)
FINE = ReadoutSettings(adc_bits=16, offset=0.5, oversampling=1)
CLOCK = ScanClock(dead_time=2e-6, settling=2e-3, conversion=52e-6)


@pytest.fixture
def table(skin):
    scan = Scan.of(skin.pattern())
    drives = [
        Drive(int(a), int(b), int(mask))
        for (a, b), mask in zip(scan.drives, scan.masks, strict=True)
    ]
    return sample_table(drives, 1, CLOCK)


def volts(sheet, skin, settings, table, *, time=0.0, faults=None):
    """(n_samples,) V at the inputs, to the last bit of a fine converter."""
    electronics = TwinElectronics(sheet, FINE, skin.current, settings, 0)
    if faults:
        electronics.set_faults(faults)
    counts = electronics.sample(table, time).astype(float) + 0.5
    return (counts * 5.0 / 2**16 - 0.5) / 40.0


LSB = 5.0 / 2**16 / 40.0


def test_the_times_of_a_scan(table, skin):
    asked = ScanSettings.of(skin)
    assert table.conversion == pytest.approx(asked.conversion)
    assert table.since[:3] == pytest.approx([2e-3, 2e-3 + 52e-6, 2e-3 + 104e-6])
    assert table.time[0] == pytest.approx(2e-6 + 2e-3)
    each = 2e-6 + 2e-3 + 6 * 52e-6
    assert table.time[6] - table.time[0] == pytest.approx(each)
    assert table.seconds == pytest.approx(8 * each)


def test_too_short_a_wait_is_seen_and_a_long_one_is_not(sheet, skin, table):
    ideal = volts(sheet, skin, QUIET, table)
    fast = volts(sheet, skin, replace(QUIET, time_constant=50e-6), table)
    assert np.abs(fast - ideal).max() <= 1.01 * LSB
    slow = volts(sheet, skin, replace(QUIET, time_constant=1e-3), table)
    missing = slow[0] - ideal[0]  # the very first scan starts from nothing
    assert missing == pytest.approx(-ideal[0] * math.exp(-2.0), abs=LSB)
    assert np.abs(slow - ideal).max() > 100 * LSB


def test_a_press_that_moves_during_a_scan_is_where_it_is_at_each_drive(sheet, skin, table):
    electronics = TwinElectronics(sheet, FINE, skin.current, QUIET, 0)

    def sliding(since):
        return (Press(-0.03 + 1.5 * since, 0.02, 3.0, 0.012),)

    electronics.follow(sliding)
    moving = electronics.sample(table, 0.0)
    middles = table.middles
    assert np.diff(middles) == pytest.approx(table.seconds / 8)
    assert middles[0] == pytest.approx(2e-6 + table.length[0] / 2)
    electronics.follow(None)
    stills = []
    for since in middles:
        sheet.set_presses(sliding(since))
        stills.append(electronics.sample(table, 1.0))
    assert (moving == np.array(stills)[table.drive, np.arange(len(moving))]).all()
    assert (moving != stills[0]).sum() > 20


def test_a_press_that_stands_still_costs_one_solution(skin, table):
    def counts(follows):
        sheet = TwinSkin.of(skin, TwinSettings.preset("textile", 3))
        electronics = TwinElectronics(sheet, FINE, skin.current, BOARD, 3)
        press = (Press(0.01, 0.02, 3.0, 0.012),)
        if follows:
            electronics.follow(lambda _: press)
        else:
            sheet.set_presses(press)
        return [electronics.sample(table, 0.1 * k).tolist() for k in range(3)], sheet.solves

    assert counts(True) == counts(False)


def test_time_goes_on_by_as_much_whether_presses_move_or_not(skin, table):
    """A sheet that only creeps: what was pressed for so long has crept for so long."""

    def crept(moves):
        textile = TwinSettings.preset("textile").material
        settings = replace(textile, temperature_sd=0.0, play=(), play_widths=())
        chosen = replace(TwinSettings(), material=settings)
        sheet = TwinSkin.of(skin, chosen)
        electronics = TwinElectronics(sheet, FINE, skin.current, QUIET, 0)
        still = Press(0.01, 0.02, 3.0, 0.012)
        electronics.follow(lambda since: (Press(0.01 + 1e-9 * since * moves, 0.02, 3.0, 0.012),))
        for k in range(4):
            electronics.sample(table, 0.5 * k)
        electronics.follow(lambda _: (still,))
        electronics.sample(table, 2.0)
        return sheet.conductivity()

    assert crept(1) == pytest.approx(crept(0), rel=1e-5)


def test_mains_are_at_the_time_of_each_sample(sheet, skin, table):
    ideal = volts(sheet, skin, QUIET, table)
    settings = replace(QUIET, hum=2e-3, hum_frequency=60.0)

    def hum(time):
        return volts(sheet, skin, settings, table, time=time) - ideal

    assert hum(1.0 + 1 / 60) == pytest.approx(hum(1.0), abs=2.1 * LSB)
    assert hum(1.0 + 1 / 120) == pytest.approx(-hum(1.0), abs=2.1 * LSB)
    one = table.channel == table.channel[0]
    turn = 2 * np.pi * 60.0 * table.time[one]
    waves = np.column_stack([np.sin(turn), np.cos(turn)])
    fit, *_ = np.linalg.lstsq(waves, hum(0.0)[one], rcond=None)
    assert hum(0.0)[one] == pytest.approx(waves @ fit, abs=2 * LSB)
    assert 0.5e-3 < np.hypot(*fit) < 4e-3


def test_channels_have_their_own_gain_and_offset(sheet, skin, table):
    ideal = volts(sheet, skin, QUIET, table)
    other = volts(sheet, skin, replace(QUIET, gain_sd=0.01, offset_sd=1e-3), table)
    gains = []
    for channel in range(8):
        mine = table.channel == channel
        gain, offset = np.polyfit(ideal[mine], other[mine], 1)
        gains.append(gain)
        assert gain * ideal[mine] + offset == pytest.approx(other[mine], abs=2 * LSB)
    assert 0.004 < np.std(gains) < 0.02
    again = volts(sheet, skin, replace(QUIET, gain_sd=0.01, offset_sd=1e-3), table)
    assert (again == other).all()


def test_contacts_wander_with_their_deviation_and_leave_differences_alone(sheet, skin, table):
    settings = replace(QUIET, contact_sd=0.05, contact_time=1.0)
    electronics = TwinElectronics(sheet, FINE, skin.current, settings, 1)
    frames = np.array([electronics.sample(table, 3.0 * k) for k in range(400)]) * LSB
    assert frames.std(axis=0).mean() == pytest.approx(0.05 * skin.current, rel=0.1)
    differences = frames[:, 1] - frames[:, 0]  # one drive: both rise with its sink
    assert differences.std() < 1.01 * LSB


def test_the_amplifier_clips_before_the_converter():
    held = replace(QUIET, low_rail=1.0, high_rail=4.0)
    found = convert(np.array([-1.0, 0.05, 1.0]), FINE, 1, held, np.random.default_rng(0))
    assert found.tolist() == [int(2**16 / 5), int(2.5 / 5 * 2**16), int(4 / 5 * 2**16)]


def test_the_bow_is_largest_in_the_middle():
    bowed = replace(QUIET, nonlinearity=8.0)
    at = np.array([0.0, 1.25, 2.5, 5.0 - 1e-3])
    found = convert((at - 0.5) / 40, FINE, 1, bowed, np.random.default_rng(0)).astype(float)
    assert found - np.floor(at / 5 * 2**16) == pytest.approx([0, 6, 8, 0], abs=1)


@pytest.mark.parametrize("oversampling", [1, 4, 16])
def test_oversampling_takes_the_noise_down_by_its_root(oversampling):
    noisy = ElectronicsSettings(noise=3.0)
    random = np.random.default_rng(2)
    coarse = replace(FINE, adc_bits=10)
    sums = convert(np.full(5000, 0.02), coarse, oversampling, noisy, random)
    mean_of = sums / oversampling
    assert mean_of.std() == pytest.approx(math.sqrt((9 + 1 / 12) / oversampling), rel=0.05)


def test_faults_show_in_the_counts(sheet, skin, table):
    full = (2**16 - 0.5) * LSB - 0.5 / 40
    cut = volts(sheet, skin, QUIET, table, faults=Faults(cut=frozenset({5})))
    assert cut[table.channel == 5] == pytest.approx(full)
    source = table.drives[table.drive, 0]
    assert np.abs(cut[(source == 5) & (table.channel != 5)]).max() <= LSB
    ideal = volts(sheet, skin, QUIET, table)
    short = volts(sheet, skin, QUIET, table, faults=Faults(shorts=frozenset({(3, 4)})))
    drive_3_4 = (source == 4) & (table.sink == 3)
    assert np.ptp(short[drive_3_4]) < 0.1 * np.ptp(ideal[drive_3_4])


def test_a_fault_of_a_missing_electrode_is_refused(sheet, skin):
    electronics = TwinElectronics(sheet, FINE, skin.current, QUIET, 0)
    with pytest.raises(ModelError, match=r"electrodes from 0 \(E1\) to 7, got 9"):
        electronics.set_faults(Faults(cut=frozenset({9})))
    assert electronics.faults == Faults()


@pytest.mark.parametrize("name", ["noise", "contact_sd", "time_constant", "hum", "crosstalk"])
def test_impossible_settings(name):
    for value in (-1.0, math.nan, math.inf):
        with pytest.raises(ModelError, match=f"{name} of 0 or more"):
            replace(QUIET, **{name: value})


def test_noise_by_name():
    settings = TwinSettings.preset("textile", seed=4)
    assert settings.with_noise(2.0).electronics == replace(settings.electronics, noise=2.0)
    with pytest.raises(ModelError, match='among ideal, textile, hydrogel, tank, got "wool"'):
        TwinSettings.preset("wool")
