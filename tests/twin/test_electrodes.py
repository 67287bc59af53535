"""Electrodes that polarise and contacts that warm, against a small-step integration; what chopping
makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from tomoskin.board.source import ScanSettings
from tomoskin.board.wire import Drive
from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.signal import Readout
from tomoskin.twin import (
    ElectronicsSettings,
    ScanClock,
    TwinSettings,
    chopped_table,
    make_electronics,
    sample_table,
    table_of,
)
from tomoskin.twin.circuit import Electrodes
from tomoskin.twin.presets import POLARISING, PRESETS

CURRENT = 1e-3
LAYER = replace(ElectronicsSettings(), double_layer=100e-6, leak=100.0)
"""A leak of 100 Ω: what is charged decays in 10 ms, so that a scan sees all of it."""
CLOCK = ScanClock(dead_time=200e-6, settling=1e-3, conversion=50e-6)
DRIVES = [Drive(1, 0, 0b11111100), Drive(5, 2, 0b11011011), Drive(0, 1, 0b11111111)]
CHANCE = np.random.SeedSequence(5)


def integrated(table, scans):
    """(n_samples,) V of the last of ``scans``, by steps of 0.2 µs of C dv/dt = i − v/R."""
    step, tau = 0.2e-6, LAYER.double_layer * LAYER.leak
    v = np.zeros(8)
    dead = (table.seconds - table.length.sum()) / len(table.drives)
    for _ in range(scans):
        read = np.zeros(len(table.channel))
        for number, (source, sink) in enumerate(table.drives):
            aim = np.zeros(8)
            aim[source], aim[sink] = CURRENT * LAYER.leak, -CURRENT * LAYER.leak
            passed = 0.0
            mine = np.flatnonzero(table.drive == number)
            for sample in [*mine, None]:
                until = table.length[number] if sample is None else table.since[sample]
                for _ in range(round((until - passed) / step)):
                    v = v + step / tau * (aim - v)
                passed = until
                if sample is not None:
                    read[sample] = v[table.channel[sample]] - v[sink]
            for _ in range(round(dead / step)):
                v = v - step / tau * v
    return read


@pytest.mark.parametrize("chopped", [False, True])
def test_double_layers_charge_and_leak_as_by_small_steps(chopped):
    table = chopped_table(DRIVES, 4, CLOCK, 250, 1) if chopped else sample_table(DRIVES, 2, CLOCK)
    electrodes = Electrodes(8, CURRENT, LAYER, CHANCE)
    for scan in range(2):
        read = electrodes.read(table, scan * table.seconds)
    expected = integrated(table, 2)
    assert np.abs(expected).max() > 5e-3
    assert read == pytest.approx(expected, abs=2e-6)


def test_what_is_charged_decays_between_scans():
    table = sample_table(DRIVES, 2, CLOCK)
    once, again = (Electrodes(8, CURRENT, LAYER, CHANCE) for _ in range(2))
    first = once.read(table, 0.0)
    again.read(table, 0.0)
    assert not np.allclose(again.read(table, table.seconds), first, atol=1e-6)
    assert again.read(table, 1.0) == pytest.approx(first, abs=1e-9)


def test_contacts_wander_by_as_much_as_they_should():
    settings = replace(ElectronicsSettings(), thermal_sd=20e-6, thermal_time=2.0)
    electrodes = Electrodes(8, CURRENT, settings, CHANCE)
    table = sample_table([Drive(1, 0, 0b11111111)], 2, CLOCK)
    read = np.array([electrodes.read(table, 2.0 * k) for k in range(4000)])
    # against the sink: √2 of one; e^-1 of it is left after the correlation time
    assert read[:, 1:].std() == pytest.approx(20e-6 * np.sqrt(2), rel=0.03)
    kept = (read[1:, 1:] * read[:-1, 1:]).mean() / read[:, 1:].var()
    assert kept == pytest.approx(np.exp(-1), abs=0.03)


def test_they_are_off_in_every_preset():
    for preset in PRESETS.values():
        assert Electrodes(8, CURRENT, preset.electronics, CHANCE).silent
    on = TwinSettings.preset("hydrogel").with_electrodes("polarising").electronics
    assert not Electrodes(8, CURRENT, on, CHANCE).silent
    assert on.double_layer == POLARISING["double_layer"]


def drift(mode):
    """V, root mean square over the rows: from the first half second to the tenth second."""
    skin = Skin.load("textile-disc-8").altered(
        {
            "material": {"sheet_resistance": "200 ohm/sq"},
            "mesh": {"cells": 200},
            "drive": {"current": "1 mA", "mode": mode},
            "readout": {"gain": 4, "offset": "1 V", "settling": "500 us"},
            "twin": {"preset": "ideal", "electrodes": "polarising"},
        }
    )
    scan = Scan.of(Pattern.adjacent(8))
    table, readout = table_of(scan, ScanSettings.of(skin)), Readout.of(scan, skin.readout)
    board = make_electronics(skin, TwinSettings.preset("ideal", 3))
    times = np.arange(0.0, 10.0, table.seconds)
    rows = []
    for time in times:
        counts = board.sample(table, float(time))
        voltages = readout(Frame(0, 0, 0.0, 1, 0, 0, *table.readings(counts)))
        assert not voltages.excluded.any()
        rows.append(voltages.values)
    values = np.array(rows)
    moved = values[times > 9.5].mean(axis=0) - values[times < 0.5].mean(axis=0)
    return float(np.sqrt(np.mean(moved**2)))


def test_an_alternating_drive_does_not_see_it():
    direct, chopped = drift("direct"), drift("chopped")
    assert direct > 5e-3
    assert chopped < direct / 50
