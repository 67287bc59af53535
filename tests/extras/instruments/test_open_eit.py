"""OpenEIT's text logs of sizes and of voltages with signs, of a uniform disc in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.files.imports import read_recording

SCANS = [(8, 3), (8, 1), (16, 8), (16, 1), (32, 16), (32, 1)]


def log_of(n, spread, polarity=None):
    """pyEIT's order: drive e, e + spread; pairs k + 1, k without driven ones."""
    z = np.exp(2j * np.pi * np.arange(n) / n)
    rows = []
    for e in range(n):
        source, sink = e, (e + spread) % n
        u = np.log(np.abs(z - z[sink]) + 1e-300) - np.log(np.abs(z - z[source]) + 1e-300)
        pairs = [((k + 1) % n, k) for k in range(n) if not {(k + 1) % n, k} & {source, sink}]
        rows += [(polarity(e) if polarity else 1.0) * (u[plus] - u[minus]) for plus, minus in pairs]
    return np.array(rows)


def read(path, frames, join=",", end=","):
    lines = (join.join(f"{value:.6f}" for value in frame) for frame in np.atleast_2d(frames))
    path.write_text("".join(f"magnitudes : {line}{end}\n" for line in lines))
    return read_recording(path)


@pytest.mark.parametrize(("n", "spread"), SCANS)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_signed_values_are_those_of_sizes(tmp_path, n, spread, way):
    gains = np.array([[1.0], [1.02], [0.99]])
    values = gains * way * log_of(n, spread)
    signed, sizes = read(tmp_path / "a.txt", values), read(tmp_path / "b.txt", abs(values))
    assert np.array_equal(signed.drive, sizes.drive)
    assert np.array_equal(signed.measure, sizes.measure)
    np.testing.assert_allclose(signed.voltages, sizes.voltages, atol=1e-9)
    assert signed.voltages.min() > 0


def test_the_case_of_sixteen(tmp_path):
    got = read(tmp_path / "signed.txt", log_of(16, 8))
    assert got.voltages.shape == (1, 96)
    np.testing.assert_allclose(got.voltages[0, :4], [0.7335, 0.4782, 0.4032, 0.4032], atol=1e-4)
    assert any("have signs, read with one polarity; 100%" in note for note in got.notes)


def test_both_ends_of_a_drive_with_the_same_sign(tmp_path):
    values = log_of(16, 8, lambda drive: 1.0 if drive < 8 else -1.0)
    got = read(tmp_path / "signed.txt", values)
    assert got.voltages.min() > 0.05
    assert any("each drive's own polarity" in note for note in got.notes)


def test_sizes_about_zero_stay_sizes(tmp_path):
    """An offset below zero in a few small values is no sign of a log of voltages."""
    sizes = abs(log_of(16, 8))
    sizes[5] = -0.001
    got = read(tmp_path / "sizes.txt", sizes)
    np.testing.assert_allclose(got.voltages[0, :4], [0.7335, 0.4782, 0.4032, 0.4032], atol=1e-4)


def test_spaces_separate_too(tmp_path):
    values = abs(log_of(8, 1))
    commas, spaces = (
        read(tmp_path / name, values, join, end)
        for name, join, end in (("a.txt", " , ", " , "), ("b.txt", " ", ""))
    )
    assert np.array_equal(commas.voltages, spaces.voltages)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("3.32 1.93 4.00", "got 3 in line 1"),
        ("3.32 x 4.00", 'got "magnitudes : 3.32 x 4.00" in line 1'),
    ],
)
def test_what_is_wrong_with_a_line_is_said(tmp_path, line, said):
    path = tmp_path / "a.txt"
    path.write_text(f"magnitudes : {line}\n")
    with pytest.raises(DataError, match=said) as raised:
        read_recording(path)
    assert "comma" not in str(raised.value)
