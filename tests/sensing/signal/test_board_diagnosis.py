"""A board on its ring of resistors: a sound one is passed, each single fault is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.sensing.signal import CountScale, LoadRing, diagnose, meter_steps
from tomoskin.sensing.signal.load_ring import potentials, single_faults

SCALE = CountScale.of(35, 5, 10)
CURRENT = 0.1
RING = LoadRing.for_current(8, CURRENT)
DRIVES = np.vstack([scan.drives for scan in RING.scans()])
FAULTS = list(single_faults(RING, DRIVES, CURRENT))


def counts_of(volts: np.ndarray, times: float = 1.0) -> np.ndarray:
    noise = np.random.default_rng(4).normal(0, 0.1, volts.shape)
    return np.clip(times * volts * SCALE.per_volt + noise, 0, SCALE.top)


def test_the_ring_is_that_of_circuit_theory() -> None:
    """Between neighbours: one resistor in parallel to all others in series."""
    volts = potentials(RING, np.array([[4, 3]]), CURRENT)[0]
    one, others = RING.ohms[3], RING.ohms.sum() - RING.ohms[3]
    assert volts[4] - volts[3] == pytest.approx(CURRENT * one * others / (one + others), rel=1e-6)
    r = RING.resistance
    assert r[4, 4] - 2 * r[4, 3] + r[3, 3] == pytest.approx(one * others / (one + others))


def test_no_exchange_of_terminals_gives_the_same_ring() -> None:
    r = RING.resistance
    between = np.diag(r)[:, None] - 2 * r + np.diag(r)
    known = np.sort(between, axis=1)
    assert len(np.unique(known.round(6), axis=0)) == 8


@pytest.mark.parametrize("channels", [8, 16])
def test_a_sound_board_of_resistors_of_one_per_cent_passes(channels: int) -> None:
    ring = LoadRing.for_current(channels, CURRENT)
    drives = np.vstack([scan.drives for scan in ring.scans()])
    rng = np.random.default_rng(7)
    for _ in range(5):
        real = LoadRing(ring.ohms * (1 + rng.uniform(-0.01, 0.01, channels)))
        found = diagnose(counts_of(potentials(real, drives, CURRENT)), ring, drives, CURRENT, SCALE)
        assert found.faults == ()
        assert found.scale == pytest.approx(1, abs=0.01)
        assert 0.02 < found.sink_ohms < 0.06


def _is_named(number: int) -> None:
    fault = FAULTS[number]
    counts = counts_of(fault.volts, 1.01)
    counts[fault.unknown] = 500.0
    found = diagnose(counts, RING, DRIVES, CURRENT, SCALE)
    assert fault.text in found.faults
    assert len(found.faults) <= 2


@pytest.mark.parametrize("number", range(0, len(FAULTS), 29))
def test_a_fault_is_named(number: int) -> None:
    _is_named(number)


@pytest.mark.slow
def test_every_fault_is_named() -> None:
    for number in range(len(FAULTS)):
        _is_named(number)


def test_a_wrong_sense_resistor_is_named() -> None:
    found = diagnose(counts_of(potentials(RING, DRIVES, 0.01)), RING, DRIVES, CURRENT, SCALE)
    assert "0.1 times" in found.faults[0]
    assert "R23" in found.faults[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda column: np.full_like(column, 1023), "E4 stays at 100%"),
        (lambda column: column / 35, "E4 stays at"),
        (lambda column: column * 0.5, "E4 is 0.5 times"),
        (lambda column: column + 60, "E4 is +60 counts off"),
    ],
)
def test_one_bad_amplifier_is_named(change, said: str) -> None:  # type: ignore[no-untyped-def]
    counts = counts_of(potentials(RING, DRIVES, CURRENT))
    counts[:, 3] = change(counts[:, 3])
    found = diagnose(counts, RING, DRIVES, CURRENT, SCALE)
    assert len(found.faults) == 1
    assert said in found.faults[0]


def test_two_faults_at_once_are_not_explained_but_shown() -> None:
    counts = counts_of(potentials(RING, DRIVES, CURRENT))
    counts[:, 3] = 0
    counts[:, 6] = 900
    found = diagnose(counts, RING, DRIVES, CURRENT, SCALE)
    assert "no single fault" in found.faults[0]
    assert all("E7" in line or "E4" in line for line in found.faults[1:])


def test_readings_of_another_board_are_refused() -> None:
    with pytest.raises(DataError, match=r"16 drives by 8 channels, got \(2, 3\)"):
        diagnose(np.zeros((2, 3)), RING, DRIVES, CURRENT, SCALE)


@pytest.mark.parametrize("current", [0.1, 0.01, 0.001])
def test_a_multimeter_tells_a_source_from_none(current: float) -> None:
    steps = {(step.stage, step.point): step for step in meter_steps(current, 8)}
    bus = steps["Arduino", "BUS"]
    assert bus.accepts(22 * current)
    assert not bus.accepts(0)
    assert not steps["Arduino", "SENSE"].accepts(12.0)
    assert not steps["supply", "+12V"].accepts(12.0)  # without 5 V
    assert not steps["Arduino", "+12V"].accepts(0)
    assert all(step.low < step.high for step in steps.values())


@pytest.mark.parametrize("five", [4.75, 4.8, 4.85, 5.2])
@pytest.mark.parametrize("twelve", [11.45, 12.0, 12.55])
def test_a_multimeter_refuses_no_good_board(five: float, twelve: float) -> None:
    """U1 has 70 to 100 Ω, and an INA118 draws 0.35 mA."""
    volts = {"+12V": twelve, "+5V": five, "2.5V": 2.5, "BUS": 2.2}
    for channels, ohms in ((8, 70.0), (16, 100.0)):
        read: dict[str, float] = {}
        for step in meter_steps(CURRENT, channels, read):
            known = volts | {"-5V": -five + ohms * 0.35e-3 * channels}
            known |= {"12V IN": twelve + 0.03, "SENSE": twelve - 1.225}
            known |= {"+12V": 0.2} if step.stage == "supply" else {}
            read[step.point] = known.get(step.point, 0.0)
            assert step.accepts(read[step.point]), step.point


def test_a_reference_that_nobody_has_measured_accuses_no_part() -> None:
    sound = counts_of(potentials(RING, DRIVES, CURRENT))
    said = {}
    for reference in (4.75, 5.0, 5.2, 5.25):
        counts = np.minimum(sound * 5.0 / reference, SCALE.top)
        unmeasured = replace(SCALE, measured=False)
        assert not diagnose(counts, RING, DRIVES, CURRENT, unmeasured).faults
        measured = CountScale.of(35, reference, 10)
        found = diagnose(counts, RING, DRIVES, CURRENT, measured)
        assert not found.faults
        said[reference] = found.scale
    assert max(said.values()) - min(said.values()) < 0.01


def test_the_documentation_has_the_same_steps() -> None:
    page = (Path(__file__).parents[3] / "docs" / "hardware.md").read_text(encoding="utf-8")
    for step in meter_steps(CURRENT, 8):
        assert f"| {step.stage} | {step.point} | {step.expected} | {step.otherwise} |\n" in page
    assert f"every single fault, {len(FAULTS)} with 8 channels" in page
