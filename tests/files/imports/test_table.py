"""The interchange file as a table in text."""

from __future__ import annotations

import numpy as np
import pytest

from tomoskin.core import DataError
from tomoskin.files.imports import read_recording


def test_the_interchange_table(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text("time_s,v_1_0_2_3,x_m,y_m,v_2_1_3_0\n0.5,1.5,0.01,,-2\n\n1,3,0.02,0.03,1e-3\n")
    got = read_recording(path)
    assert np.array_equal(got.voltages, [[1.5, -2], [3, 1e-3]])
    assert np.array_equal(got.drive, [[1, 0], [2, 1]])
    assert np.array_equal(got.measure, [[2, 3], [3, 0]])
    assert np.array_equal(got.time, [0.5, 1])
    assert np.array_equal(got.labels, [[0.01, np.nan], [0.02, 0.03]], equal_nan=True)
    path.write_text("dv_1_0_2_3\n1\n")
    assert read_recording(path).is_change


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v_1_0_2_3,colour\n1,2\n", 'line 1.*got "colour"'),
        ("v_1_0_2_3,dv_1_0_2_3\n1,2\n", "got dv and v"),
        ("v_1_0_2_3\nmany\n", 'line 2.*v_1_0_2_3, got "many"'),
        ("v_1_0_2_3,v_1_0_2_3\n1,1\n", "each column once"),
        ("v_1_0_2_3\n", "empty"),
        ("nothing,known\n1,2\n", "a session, an interchange file, a table of voltages"),
        ("", "is an empty file"),
    ],
)
def test_tables_that_cannot_be_meant(tmp_path, text, said):
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(DataError, match=said):
        read_recording(path)


def test_complex_voltages_as_text(tmp_path):
    path = tmp_path / "complex.csv"
    path.write_text("time_s,v_1_0_2_3,v_1_0_3_4\n0,1.5,2\n1,1.5-0.2j,2+1e-1i\n2, ,-1j\n")
    got = read_recording(path)
    assert got.voltages[:2].tolist() == [[1.5, 2.0], [1.5 - 0.2j, 2 + 0.1j]]
    assert np.isnan(got.voltages[2, 0])
    assert got.voltages[2, 1] == -1j
    assert got.time.tolist() == [0.0, 1.0, 2.0]
    path.write_text("time_s,v_1_0_2_3\n1j,1.5\n")
    with pytest.raises(DataError, match="real numbers in time_s"):
        read_recording(path)


def test_a_table_that_outgrows_memory_is_refused(tmp_path, monkeypatch):
    """Eight bytes of memory for each two of text."""
    monkeypatch.setattr("tomoskin.core.user_files.machine_memory", lambda: 200_000)
    path = tmp_path / "zeros.csv"
    path.write_text("v_1_0_2_3,v_1_0_3_4\n" + 5000 * "0,0\n")
    with pytest.raises(DataError, match="more than a quarter of this machine's"):
        read_recording(path)


def test_a_return_inside_a_line_of_a_table_is_refused(tmp_path):
    table = tmp_path / "x.csv"
    table.write_bytes(b"time_s,v_1_0_2_3\n0,1.5\n1,1\r.5\n")
    with pytest.raises(DataError, match=r"x\.csv, line 3: is not a table"):
        read_recording(table)
