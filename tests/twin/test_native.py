"""The twin by the native engine and by numpy: the same sheet, but for rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from conftest import NO_ENGINE
from tomoskin.board.source import ScanSettings
from tomoskin.core import FloatArray
from tomoskin.model.forward import State, engine_choice
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.twin import (
    PRESETS,
    Circle,
    Finger,
    Probe,
    Square,
    Stretched,
    TwinSettings,
    TwinSkin,
    make_electronics,
    table_of,
)
from tomoskin.twin.material import MaterialState, stepped

SEEDS = (101, 102, 103)
BRITTLE = {"breakdown": (1.4, 0.3), "breakdown_times": (0.2, 3.0), "wear": 3e-4}


def scene(random: np.random.Generator, reach: float) -> tuple[Probe, ...]:
    """Up to four probes of any face, some of them turned and dragging."""
    probes = []
    for _ in range(random.integers(0, 5)):
        x, y = random.uniform(-0.6 * reach, 0.6 * reach, 2).tolist()
        force, radius, angle = random.uniform((0, 0.004, -3), (6, 0.02, 3)).tolist()
        shape = (Circle(radius), Finger(), Square(radius, 0.02))[random.integers(3)]
        probe = Probe(shape, x, y, force, angle if random.random() < 0.7 else 0.0)
        probes.append(probe.moving(1.0, 0.3, 0.2) if random.random() < 0.3 else probe)
    return tuple(probes)


def frames(
    monkeypatch: pytest.MonkeyPatch, engine: str, skin: Skin, settings: TwinSettings
) -> list[tuple[FloatArray, ...]]:
    """Load, conductivity, resistance and counts of scenes that follow each other."""
    monkeypatch.setenv(engine_choice.VARIABLE, engine)
    board = make_electronics(skin, settings)
    sheet, table = board.sheet, table_of(Scan.of(skin.pattern()), ScanSettings.of(skin))
    assert sheet.model.engine.name == engine
    random = np.random.default_rng(settings.seed)
    reach = float(np.linalg.norm(skin.electrode_centres, axis=1).min())
    found: list[tuple[FloatArray, ...]] = []
    for number in range(6):
        sheet.set_presses(scene(random, reach))
        sheet.set_pose((Stretched(0.02, 0.1),) if number == 3 and settings.bend.height else ())
        counts = board.sample(table, 0.2 * number**2)
        found.append((sheet.load, sheet.conductivity(), sheet.resistance(), counts.astype(float)))
    return found


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("preset", [*PRESETS, "brittle"])
def test_native_code_and_numpy_make_the_same_frames(
    monkeypatch: pytest.MonkeyPatch, skin: Skin, preset: str, seed: int
) -> None:
    pytest.importorskip("tomoskin_core", reason=NO_ENGINE)
    settings = TwinSettings.preset(preset if preset in PRESETS else "textile", seed)
    if preset == "brittle":
        settings = replace(settings, material=replace(settings.material, **BRITTLE))
    both = (frames(monkeypatch, engine, skin, settings) for engine in ("native", "scipy"))
    for native, plain in zip(*both, strict=True):
        for one, other in zip(native[:3], plain[:3], strict=True):
            assert one == pytest.approx(other, rel=1e-9, abs=1e-12 * np.abs(other).max())
        # a conversion on the edge between two codes may fall on either side
        assert np.mean(native[3] != plain[3]) < 1e-3


@pytest.mark.parametrize("n", [1, 7, 8, 17])
@pytest.mark.parametrize("preset", ["ideal", "textile", "brittle"])
def test_sheets_of_any_number_of_cells_remember_the_same(
    monkeypatch: pytest.MonkeyPatch, preset: str, n: int
) -> None:
    pytest.importorskip("tomoskin_core", reason=NO_ENGINE)
    settings = TwinSettings.preset("ideal" if preset == "ideal" else "textile").material
    if preset == "brittle":
        settings = replace(settings, **BRITTLE)
    random, unloaded = np.random.default_rng(n), np.linspace(1.0, 2.0, n)
    loads = [random.normal(0.0, 0.02, (4, n)) * [[1], [1], [1], [0.1]] for _ in range(5)]
    native, plain = (MaterialState.fresh(settings, n) for _ in range(2))
    for load in loads:
        monkeypatch.setenv(engine_choice.VARIABLE, "native")
        native, found = stepped(native, settings, load, 0.3, 0.5, unloaded=unloaded)
        monkeypatch.setenv(engine_choice.VARIABLE, "scipy")
        plain, expected = stepped(plain, settings, load, 0.3, 0.5, unloaded=unloaded)
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-14)
    assert native.memory.late == pytest.approx(plain.memory.late, rel=1e-12, abs=1e-16)
    assert native.worn == pytest.approx(plain.worn, rel=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("preset", PRESETS)
def test_the_fast_solve_is_the_exact_one(skin: Skin, preset: str, seed: int) -> None:
    """Promised is a tenth of the read-out's noise."""
    pytest.importorskip("tomoskin_core", reason=NO_ENGINE)
    sheet = TwinSkin.of(skin, TwinSettings.preset(preset, seed))
    random = np.random.default_rng(seed)
    readout = skin.readout
    level = readout.reference_voltage / readout.gain / (1 << readout.adc_bits)
    noise = 0.7 * level / np.sqrt(readout.oversampling)
    for _ in range(4):
        sheet.set_presses(scene(random, 0.08))
        sheet.advance(0.1)
        exact = State(sheet.model, sheet.conductivity()).transfer_resistance
        wrong = skin.current * np.abs(sheet.resistance() - exact).max()
        assert wrong < 1e-6 * noise
