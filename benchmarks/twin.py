"""The twin: frames per second with three moving presses, stage by stage, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from report import Report
from tomoskin.board.source import ScanSettings
from tomoskin.board.wire import Drive
from tomoskin.model.forward import State
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.run import in_processes, in_this_process, make_set
from tomoskin.twin import (
    COMMON_PRESSES,
    Press,
    SampleTable,
    ScanClock,
    SetPlan,
    TwinElectronics,
    TwinSettings,
    TwinSkin,
    make_electronics,
    sample_table,
)
from tomoskin.twin.dent import solved_dent

CASES = (
    ("textile-disc-16", "ideal", 3000),
    ("textile-disc-16", "textile", 3000),
    ("textile-disc-16", "ideal", 4800),
    ("textile-disc-8", "textile", 1056),
    ("tank-16", "tank", 3000),
)
COLUMNS = (
    *("skin", "preset", "triangles", "dent ms", "material ms", "solve ms"),
    *("whole frame ms", "frames /s", "best tenth", "× real time", "off, of noise"),
)
FRAMES, ROUND = 300, 100
PROMISED = 5000
CHECKED = 20
SEED = 1
SET, SET_SKIN, SET_ROUNDS, PROCESSES = 5000, "textile-disc-8", 2, (1, 2)


def run(data: Path | None) -> tuple[Report, ...]:
    """Time every case; ``data`` is not needed."""
    del data
    rows = tuple(row(*case) for case in CASES)
    report = Report(
        "twin: presses → counts",
        COLUMNS,
        rows,
        (
            f"{FRAMES} frames, each with three flat round presses of 12 mm and 3 N that have moved "
            f"on a circle since the frame before; seed {SEED}",
            "median of the frames' processor time, from presses that are there; every frame is "
            "solved again",
            f"off: largest difference to a model's whole solve over {CHECKED} frames, at the "
            "amplifiers, as a part of the read-out noise of a sample; promised: a tenth",
            "best tenth: frames/s of the 10th percentile, what a quiet machine comes close to",
            f"promised: {PROMISED} frames/s for 16 electrodes at 3k triangles",
            "ideal: a sheet that conducts equally in all directions; textile: a tensor per cell, "
            "creep, play, temperature, all vices of the board",
        ),
    )
    return report, _labelled()


def _labelled() -> Report:
    """Labelled frames by one process and by two, starts and writing included."""
    took: dict[int, list[float]] = {n: [] for n in PROCESSES}
    for round_ in range(SET_ROUNDS):
        for n in PROCESSES:
            plan = SetPlan(Skin.load(SET_SKIN).to_toml(), COMMON_PRESSES, "textile", round_, SET)
            with TemporaryDirectory() as folder:
                took[n].append(_set_seconds(plan, Path(folder) / "set", n))
    alone = min(took[1])
    return Report(
        "twin: labelled frames, over processes",
        ("skin", "frames", "processes", "s, least", "s, most", "frames /s", "× one process"),
        tuple(
            (
                SET_SKIN,
                SET,
                n,
                round(min(times), 1),
                round(max(times), 1),
                round(SET / min(times)),
                round(alone / min(times), 2),
            )
            for n, times in took.items()
        ),
        (
            f"one round press each, preset textile; {SET_ROUNDS} rounds in turn, seeds from 0",
            "from the plan to files; in two processes, with their start",
            "each process first solves the dents of 25 faces, about 2.5 s of processor time",
        ),
    )


def _set_seconds(plan: SetPlan, out: Path, processes: int) -> float:
    solved_dent.cache_clear()
    start = time.perf_counter()
    workers = in_this_process if processes == 1 else in_processes(processes)
    make_set(plan, out, workers, lambda _, __: None)
    return time.perf_counter() - start


def row(name: str, preset: str, triangles: int) -> tuple[object, ...]:
    """Values under ``COLUMNS``."""
    settings = TwinSettings.preset(preset, SEED)
    cells = round(triangles / settings.mesh_ratio)
    skin = Skin.load(name).altered({"mesh": {"cells": cells}})
    board, table = make_electronics(skin, settings), table_of(skin)
    sheet = board.sheet
    for number in range(10):
        _frame(board, table, number, skin)()
    spent = [
        (_spent(_frame(board, table, k, skin)), *_stages(sheet, _presses(k, skin)))
        for k in range(10, FRAMES)
    ]
    whole, dent, sigma, solve = 1e3 * np.median(spent, axis=0)
    quiet = 1e3 * float(np.percentile([times[0] for times in spent], 10))
    rate = 1e3 / whole
    return (
        name,
        preset,
        len(sheet.model.mesh.cells),
        *(round(float(part), 3) for part in (dent, sigma, solve, whole)),
        round(float(rate)),
        round(1e3 / quiet),
        round(float(rate * table.seconds), 1),
        float(f"{_off(sheet, skin, settings):.1g}"),
    )


def _off(sheet: TwinSkin, skin: Skin, settings: TwinSettings) -> float:
    """Largest difference to the exact model, as a part of a sample's noise."""
    readout, wrong = skin.readout, 0.0
    for number in range(CHECKED):
        sheet.set_presses(_presses(number, skin))
        found, sigma = sheet.resistance(), sheet.conductivity()
        exact = State(sheet.model, sigma).transfer_resistance
        wrong = max(wrong, float(np.abs(found - exact).max()))
    code = readout.reference_voltage / readout.gain / (1 << readout.adc_bits)
    return skin.current * wrong / (settings.electronics.noise * code / readout.oversampling**0.5)


def _frame(
    board: TwinElectronics, table: SampleTable, number: int, skin: Skin
) -> Callable[[], object]:
    """What makes a frame, of presses that are there already."""
    presses, time_ = _presses(number, skin), number * table.seconds

    def frame() -> object:
        board.sheet.set_presses(presses)
        return board.sample(table, time_)

    return frame


def _stages(sheet: TwinSkin, presses: tuple[Press, ...]) -> tuple[float, float, float]:
    """s of dent, material and solve: each is asked for by itself and kept for the next."""
    sheet.set_presses(())
    sheet.resistance()
    dent = _spent(lambda: sheet.set_presses(presses))
    return dent, _spent(sheet.conductivity), _spent(sheet.resistance)


def _spent(work: Callable[[], object]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def _presses(number: int, skin: Skin) -> tuple[Press, ...]:
    turn = 2 * np.pi * (number / ROUND + np.arange(3) / 3)
    reach = 0.5 * float(np.linalg.norm(skin.electrode_centres, axis=1).min())
    places = reach * np.column_stack([np.cos(turn), np.sin(turn)])
    return tuple(Press(x, y, 3.0, 0.012) for x, y in places.tolist())


def table_of(skin: Skin) -> SampleTable:
    """The samples of a skin's scan, and when they are taken."""
    scan, asked = Scan.of(skin.pattern()), ScanSettings.of(skin)
    drives = [
        Drive(source, sink, mask)
        for (source, sink), mask in zip(scan.drives.tolist(), scan.masks.tolist(), strict=True)
    ]
    clock = ScanClock(asked.dead_time, asked.settling, asked.conversion)
    return sample_table(drives, asked.oversampling, clock)
