"""Files of every format whose electrodes or values stand in another order than their tables say."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from tomoskin.core import DataError, FloatArray, IntArray, PatternError
from tomoskin.extras.instruments import guess_skin, order_fault
from tomoskin.files.imports import column_names, read_recording
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare, recorded_frames

pytest.importorskip("tomoskin.extras.greit", reason="the tank is a skin of another extra")

N = 16
RING = np.column_stack([np.arange(N), (np.arange(N) + 1) % N])
SCAN = np.repeat(RING, N, axis=0), np.tile(RING, (N, 1))
FREE = ~(SCAN[0][:, :, None] == SCAN[1][:, None, :]).any(axis=(1, 2))
HALF = RING, Pattern.adjacent(N)
NOISE = np.exp(np.random.default_rng(1).normal(0.0, 0.05, N * N))


@cache
def resistance() -> FloatArray:
    return np.asarray(tank().model.transfer_resistance(tank().skin.conductivity))


@cache
def tank() -> Prepared:
    one_step = {"method": "one-step", "noise_figure": None}
    skin = Skin.load("tank-16").altered({"inverse": one_step, "mesh": {"cells": 1000}})
    return prepare(skin)


def voltages(wires: IntArray, read: IntArray) -> FloatArray:
    """(256,) of a full scan, source k and sink k + 1, pair j and j + 1, with 5 % of error."""
    r = resistance()
    (source, sink), (plus, minus) = wires[SCAN[0]].T, wires[read[SCAN[1]]].T
    values = r[plus, source] - r[plus, sink] - r[minus, source] + r[minus, sink]
    return np.asarray(NOISE * values)


def npz(path: Path, **arrays: Any) -> Path:
    np.savez(path / "x.npz", **arrays)
    return path / "x.npz"


def mat(path: Path, **arrays: Any) -> Path:
    savemat(path / "x.mat", arrays)
    return path / "x.mat"


def text(path: Path, *lines: str) -> Path:
    (path / "x.txt").write_text("\n".join([*lines, ""]))
    return path / "x.txt"


EYE = np.eye(N) - np.roll(np.eye(N), 1, axis=1)


def sciospec(path: Path, v: FloatArray) -> Path:
    """Potentials that have these differences, but for what is left over around the ring."""
    channels = ",".join(map(str, range(1, N + 1)))
    every = f"MeasurementChannelsIndependentFromInjectionPattern: {channels}"
    lines = ["18", *15 * ["1"], f"MeasurementChannels: {channels}", every]
    for k, row in enumerate(v.reshape(N, N)):
        potentials = -np.cumsum(np.concatenate([[0.0], row[:-1] - row.mean()]))
        lines += [f"{k + 1} {(k + 1) % N + 1}", "\t".join(f"{p!r}\t0" for p in potentials.tolist())]
    return text(path, *lines)


def serial(path: Path, v: FloatArray) -> Path:
    lines = ["time_pc [s],Mass [g],time_mcu[ms],data [mV]", "0,0,A" + 16 * ","]
    for k, row in enumerate(v.reshape(N, N)):
        lines.append(",".join([f"{k}", "0", f"{k}", *(f"{-1e3 * x:.6f}" for x in row)]))
    return text(path, *lines)


FORMATS: dict[str, Callable[[Path, FloatArray], Path]] = {
    "interchange": lambda p, v: npz(p, voltages=v[None], drive=SCAN[0], measure=SCAN[1]),
    "csv": lambda p, v: text(p, ",".join(column_names(*SCAN)), ",".join(map(repr, v.tolist()))),
    "eidors": lambda p, v: mat(p, stim=EYE, meas=np.tile(EYE, (N, 1)), vi=v[:, None],
                               meas_stim=np.repeat(np.arange(1, N + 1), N)),
    "ktc": lambda p, v: npz(p, Inj=EYE.T, Mpat=EYE.T, Uel=v, Uelref=v),
    "kit4": lambda p, v: npz(p, CurrentPattern=EYE.T, MeasPattern=EYE.T, Uel=v.reshape(N, N).T),
    "pyeit": lambda p, v: npz(p, ex_mat=RING, v=v, meas_mat=np.tile(RING, (N, 1, 1))),
    "open_eit": lambda p, v: text(p, "magnitudes : " + ", ".join(f"{x:.9f}" for x in abs(v[FREE]))),
    "eit_kit": lambda p, v: text(p, "origin frame", *(f"{x:.9f}" for x in abs(v * FREE)), "frame",
                                 *(f"{x:.9f}" for x in abs(v * FREE))),
    "sixteen": lambda p, v: npz(p, v=v[None], inj=SCAN[0], meas=SCAN[1], valid=FREE),
    "eskin": lambda p, v: npz(p, v=-v[None], inj=SCAN[0], meas=SCAN[1]),
    "sciospec": sciospec,
    "serial": serial,
}  # fmt: skip

SAME = np.arange(N)


def exchanged(a: int) -> IntArray:
    wires = SAME.copy()
    wires[[a, (a + 1) % N]] = (a + 1) % N, a
    return wires


def said(path: Path) -> str:
    """What a person hears of the order of a file's electrodes: in words of their own, or not."""
    try:
        recording = read_recording(path)
        found = recorded_frames(tank(), recording.in_order_of(tank().pattern), range(1))
    except DataError as error:
        return str(error)
    return order_fault(recording, resistance()) or found.agreement.doubt(volts=False) or ""


def test_nothing_is_said_of_more_electrodes_than_the_skin_has(tmp_path: Path) -> None:
    recording = read_recording(FORMATS["interchange"](tmp_path, voltages(SAME, SAME)))
    assert order_fault(recording, resistance()[: N // 2, : N // 2]) is None


@pytest.mark.parametrize("name", FORMATS)
def test_what_stands_in_another_order_is_named(tmp_path: Path, name: str) -> None:
    write, whole = FORMATS[name], voltages(SAME, SAME)
    assert said(write(tmp_path, whole)) == ""
    turned = voltages(np.roll(SAME, 3), SAME)  # which no data can tell
    assert said(write(tmp_path, turned)) == ""
    assert said(write(tmp_path, voltages(SAME[::-1], SAME))) == ""
    for a in (0, 6, 15):
        assert "are exchanged" in said(write(tmp_path, voltages(exchanged(a), SAME))), a
    for by in (1, -1, 2):
        assert said(write(tmp_path, np.roll(whole, by))), f"values shifted by {by}"
    assert said(write(tmp_path, voltages(SAME, (SAME + 1) % N))), "measured pairs shifted"
    assert said(write(tmp_path, voltages(SAME, -SAME % N))), "measured pairs counted back"


def turned(after: int) -> IntArray:
    """(256,) the row of a full scan that stands at each place, each drive's rows from its own."""
    drive = np.arange(N)[:, None]
    return np.asarray((N * drive + (drive + after + np.arange(N)) % N).ravel())


@pytest.mark.parametrize("sizes", [False, True])
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize(("after", "words"), [(2, "at the drive"), (5, "5 electrodes after the")])
def test_rows_that_begin_at_each_drive_are_named(tmp_path, sizes, free, after, words):
    """As pyEIT's rotate_meas and most boards of 16 electrodes have them."""
    whole, order = voltages(SAME, SAME), turned(after)
    values = whole[order]
    if free:
        values = values[FREE[order]]
    drive, measure = (table[FREE] if free else table for table in SCAN)
    values = abs(values) if sizes else values
    path = npz(tmp_path, voltages=values[None], drive=drive, measure=measure)
    fault = order_fault(read_recording(path), resistance())
    assert fault is not None
    assert f"the rows of each drive begin {words}" in fault
    path = npz(tmp_path, voltages=whole[None], drive=SCAN[0], measure=SCAN[1])
    assert order_fault(read_recording(path), resistance()) is None


def test_tables_that_begin_at_each_drive_with_values_that_do_not_are_named(tmp_path):
    order = turned(2)
    order = order[FREE[order]]
    path = npz(
        tmp_path,
        voltages=voltages(SAME, SAME)[FREE][None],
        drive=SCAN[0][order],
        measure=SCAN[1][order],
    )
    fault = order_fault(read_recording(path), resistance())
    assert fault is not None
    assert "begin at E1" in fault
    table = {"drive": SCAN[0][order], "measure": SCAN[1][order]}
    right = npz(tmp_path, voltages=voltages(SAME, SAME)[order][None], **table)
    assert order_fault(read_recording(right), resistance()) is None


@pytest.mark.parametrize("name", FORMATS)
def test_a_skin_is_guessed_for_every_format(tmp_path: Path, name: str) -> None:
    path = FORMATS[name](tmp_path, voltages(SAME, SAME))
    text = guess_skin(read_recording(path))
    skin = Skin.from_toml(text)
    assert skin.n_electrodes == N
    assert skin.pattern().identity == Pattern.adjacent(N).identity
    assert "# Sure: these are the rows of the file." in text
    assert "# No data can tell where E1 is" in text
    agreement = float(text.split("agrees with the untouched frame by ")[1][:5])
    assert agreement > 0.97
    assert skin.polarity == 1.0
    ordered = read_recording(path).in_order_of(skin.pattern())
    assert recorded_frames(prepare(skin), ordered, range(1)).agreement.cosine > 0.97


def test_a_guess_says_what_is_not_sure(tmp_path: Path) -> None:
    write, whole = FORMATS["interchange"], voltages(SAME, SAME)
    text = guess_skin(read_recording(write(tmp_path, voltages(exchanged(4), SAME))))
    assert "# Check the order of the electrodes: its untouched frame looks as if E5 and E6" in text
    assert "not sure" in text
    assert Skin.from_toml(guess_skin(read_recording(write(tmp_path, -whole)))).polarity == -1.0
    few = FREE & (SCAN[0][:, 0] < 8)
    path = npz(tmp_path, voltages=whole[None, few], drive=SCAN[0][few], measure=SCAN[1][few])
    skin = Skin.from_toml(guess_skin(read_recording(path)))
    assert skin.pattern().identity == Pattern.from_tables(SCAN[0][few], SCAN[1][few]).identity
    path = npz(tmp_path, dv=whole[None], drive=SCAN[0], measure=SCAN[1])
    assert "# Not in the data, which are differences" in guess_skin(read_recording(path))
    waves = np.cos(2 * np.pi * np.outer(np.arange(1, 9), np.arange(N)) / N)
    many = Pattern.from_pairs(N, waves, RING, include_driven=True)
    path = npz(tmp_path, voltages=np.ones((1, 128)), drive=many.drive, measure=many.measure)
    with pytest.raises(PatternError, match="208 of 208 rows are not in the recording"):
        guess_skin(read_recording(path))
