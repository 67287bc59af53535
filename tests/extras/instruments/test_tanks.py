"""Files of tanks and instruments of others: KIT4, Sciospec, complex voltages as text."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.io import savemat
from scipy.io.matlab import MatlabOpaque

from tomoskin.core import DataError
from tomoskin.extras.instruments import matlab
from tomoskin.files.imports import read_recording
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin

pytest.importorskip("tomoskin.extras.greit", reason="the tank is a skin of another extra")


def kit4(factor=1.0):
    """A file of that tank: adjacent injections, then those of the first reversed."""
    n = 16
    pairs = (np.eye(n) - np.roll(np.eye(n), 1, axis=0)).astype(int)
    pattern = Pattern.skip(n, 0, include_driven=True)
    water = (
        ForwardModel(Skin.load("tank-16").mesh(), pattern, 0.5, 1e-3)
        .solve(1.0)
        .voltages.reshape(n, n)
        .T
    )
    water = -water  # current enters at the first of the pair, as columns of the pattern say
    both = np.hstack([water, -factor * water])
    return {
        "CurrentPattern": 1.4 * np.hstack([pairs, -pairs]),
        "MeasPattern": pairs,
        "Uel": np.stack([both, 1.1 * both]),
        "water": both,
    }


def test_kit4_counts_clockwise_and_means_what_was_injected_twice(tmp_path):
    path = tmp_path / "kit4.npz"
    np.savez(path, **kit4(1.02))
    got = read_recording(path)
    assert got.voltages.shape == (2, 256)
    assert any("256 of 512 rows repeat another's measurement" in note for note in got.notes)
    skin = Skin.load("tank-16")
    ordered = got.in_order_of(skin.pattern())
    expected = ForwardModel(skin.mesh(), skin.pattern(), 0.5, 1e-3).solve(1.0).voltages
    assert ordered.reference == pytest.approx(1.01 * expected)
    assert ordered.voltages[1] == pytest.approx(1.1 * ordered.reference)


def sciospec(channels, every, injections):
    """A file of potentials: 1 V at the first channel of an injection, falling along the ring."""
    lines = ["18", "2", "setup", *15 * ["1"]]
    lines[16] = "MeasurementChannels: " + ",".join(map(str, channels))
    lines[17] = "MeasurementChannelsIndependentFromInjectionPattern: " + ",".join(map(str, every))
    for first, second in injections:
        potentials = [0.0 if c not in channels else (c - first) % 16 for c in every]
        lines += [f"{first} {second}", "\t".join(f"{p}\t{-0.5 * p}" for p in potentials)]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("every", [range(1, 17), range(1, 33)])
def test_sciospec_files_hold_potentials(tmp_path, every):
    path = tmp_path / "setup_00001.eit"
    path.write_text(sciospec(range(1, 17), every, [(k, k % 16 + 1) for k in range(1, 17)]))
    got = read_recording(path)
    assert got.voltages.shape == (1, 208)
    assert got.drive[0].tolist() == [0, 1]
    assert got.measure[0].tolist() == [2, 3]
    assert got.voltages[0, 0] == -1.0 + 0.5j  # one channel further on is one higher
    ordered = got.in_order_of(Pattern.adjacent(16))
    assert ordered.voltages.shape == (1, 208)


@pytest.mark.parametrize("every", [range(1, 17), range(1, 33)])
@pytest.mark.parametrize("first", [1, 10])
def test_sciospec_files_of_older_programs(tmp_path, every, first):
    """Without the lines that name channels: those that are driven are the electrodes."""
    channels = range(first, first + 16) if len(every) > 16 else every
    injections = [(c, channels[(k + 1) % 16]) for k, c in enumerate(channels)]
    newer, older = tmp_path / "new.eit", tmp_path / "old.eit"
    text = sciospec(channels, every, injections)
    newer.write_text(text)
    lines = text.splitlines()
    older.write_text("\n".join(["11", *lines[1:11], *lines[18:]]) + "\n")
    got, expected = read_recording(older), read_recording(newer)
    for name in ("voltages", "drive", "measure"):
        assert np.array_equal(getattr(got, name), getattr(expected, name))
    older.write_text("\n".join(["12", *lines[1:11], lines[16], *lines[18:]]) + "\n")
    if len(every) == 16:
        assert np.array_equal(read_recording(older).voltages, expected.voltages)


def test_sciospec_files_that_are_not_one_frame(tmp_path):
    path = tmp_path / "setup_00001.eit"
    text = sciospec(range(1, 17), range(1, 17), [(1, 2), (2, 3)])
    for wrong, message in (
        (text.replace("\n2 3\n", "\n2 17\n"), 'got "2 17"'),
        (text.replace("\n2 3\n", "\n0.5\t0.5\n"), "one frame of one frequency"),
        (text[: text.index("\n1 2\n") + 1], "holds no injection"),
        (text.replace("\n1 2\n", "\n1 2\n1.0\t"), "32 or 32 numbers for an injection, got 33"),
    ):
        path.write_text(wrong)
        with pytest.raises(DataError, match=message):
            read_recording(path)


def test_matlab_objects_are_refused_with_what_to_do(tmp_path, monkeypatch):
    """Written by MATLAB alone, so what scipy makes of one stands for it."""
    path = tmp_path / "class.mat"
    savemat(path, {"a": 1.0})
    thing = MatlabOpaque(np.zeros(1, dtype=[("s0", "O"), ("s1", "O"), ("s2", "O"), ("arr", "O")]))
    monkeypatch.setattr(matlab, "load_matlab", lambda _: {"eit": thing, "n": np.ones(2)})
    with pytest.raises(DataError, match=r"objects \(eit\), which only MATLAB.*struct\(object\)"):
        read_recording(path)
