"""What electrodes and amplifiers add to the sheet: the emulators agree with the twin."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tomoskin.board.source import Link, ScanSettings, SerialTransport
from tomoskin.core import Frame
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.twin import ElectronicsSettings, TwinSettings, table_of
from tomoskin.twin.circuit import Electrodes
from tomoskin_emulator.board_process import (
    BoardProcess,
    BoardPrograms,
    Front,
    OwnVoltages,
    SkinMemory,
)
from tomoskin_emulator.source import open_emulator, own_of

BITS = {"mega": 10, "pico": 12}
CURRENT, MIDDLE, REFERENCE = 0.04, 2.5, 5.0
"""A, V, V."""
LAYER = ElectronicsSettings(double_layer=2e-3, leak=100.0)
SETTLING = 10e-3
"""s: so long that it does not matter what each board's conversions take."""
SCAN = Scan.of(Pattern.opposite(8))
N = 8
POTENTIALS = 0.03 * np.arange(N)
OFFSETS = 0.02 * (np.arange(N) % 3)
PATIENCE = 60.0


@pytest.fixture(params=BITS)
def board(request: pytest.FixtureRequest) -> tuple[str, BoardPrograms]:
    return request.param, request.getfixturevalue("pico" if request.param == "pico" else "programs")


def settled(link: Link, after: float) -> Frame:
    """The first frame that begins ``after`` s of the board's time behind the very first."""
    first: Frame | None = None
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        for item in link.poll(0.05):
            if isinstance(item, Frame):
                first = first or item
                if item.ticks - first.ticks > after * 250e3:
                    return item
    raise AssertionError("no frame")


def test_double_layers_charge_as_the_twins(
    board: tuple[str, BoardPrograms], tmp_path: Path
) -> None:
    kind, programs = board
    settings = ScanSettings(1, SETTLING, CURRENT, adc_bits=BITS[kind])
    levels = 2.0 ** BITS[kind]
    front = Front(CURRENT, 1e9, 1.0, MIDDLE, REFERENCE, levels, 0.0)
    own = OwnVoltages(POTENTIALS, OFFSETS, LAYER.double_layer, LAYER.leak)
    memory = SkinMemory(tmp_path / "skin", front, np.zeros((N, N)), own=own)
    process = BoardProcess(programs, memory.path, CURRENT, "-f")
    tau = LAYER.double_layer * LAYER.leak
    with Link(SerialTransport(process.port), SCAN, settings) as link:
        samples = settled(link, 8 * tau).samples
    process.close()
    memory.close()
    assert process.last_words == ""

    table = table_of(SCAN, settings)
    twin = Electrodes(N, CURRENT, LAYER, np.random.SeedSequence(0))
    layers = [twin.read(table, number * table.seconds) for number in range(100)][-1]
    still = POTENTIALS[table.channel] - POTENTIALS[table.sink] + OFFSETS[table.channel]
    read = samples * REFERENCE / levels - MIDDLE - still
    assert np.ptp(layers) > 0.5
    np.testing.assert_allclose(read, layers, atol=0.03)


def test_a_skin_that_polarises_does_so_before_an_emulated_board_too(
    pico: BoardPrograms, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tomoskin_emulator.source.programs_of", lambda _: pico)
    settings = TwinSettings.preset("ideal").with_noise(0.0)
    monkeypatch.setattr("tomoskin.twin.read_settings", lambda *_: settings)
    plain = Skin.load("textile-disc-8")
    ionic = plain.altered({"twin": {"electrodes": "polarising"}})
    frames = []
    for skin in (plain, ionic):
        with Link(open_emulator("pico", skin), SCAN, ScanSettings.of(skin)) as link:
            frames.append(settled(link, 0.2).samples.astype(float))
    volt = 4 * 4096 * plain.readout.gain / plain.readout.reference_voltage
    apart = np.abs(frames[1] - frames[0]).max() / volt
    assert apart > 20e-6


def test_offsets_and_warmth_follow_the_seed() -> None:
    skin = Skin.load("textile-disc-8")
    settings = TwinSettings.preset("textile", seed=3).with_electrodes("polarising")
    own, thermal = own_of(skin, settings)
    again, _ = own_of(skin, settings)
    other, _ = own_of(skin, replace(settings, seed=4))
    np.testing.assert_array_equal(own.offsets, again.offsets)
    assert not np.array_equal(own.offsets, other.offsets)
    before = thermal.volts
    thermal.wander(1.0)
    assert 0 < np.abs(thermal.volts - before).max() < 1e-4
    assert own_of(skin, TwinSettings.preset("ideal"))[0].double_layer == 0.0
