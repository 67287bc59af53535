"""A session that was exported for MATLAB is read again, whole or damaged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat, whosmat

from damage import mutated
from tomoskin.core import DataError
from tomoskin.files.exports.matlab_file import write_matlab
from tomoskin.files.imports import read_recording
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.signal import Recording

PATTERN = Pattern.adjacent(8)
COUNT = 100


@pytest.fixture
def recording() -> Recording:
    """Ten frames at times of their own, with the places of touches."""
    rng = np.random.default_rng(5)
    return Recording(
        voltages=rng.normal(size=(10, PATTERN.n_meas)),
        drive=PATTERN.drive,
        measure=PATTERN.measure,
        time=np.cumsum(rng.uniform(0.05, 0.1, 10)),
        labels=rng.normal(size=(10, 2)),
        reference=None,
        is_change=False,
        source="x",
        idle=4,
        timed=True,
        board_known=True,
    )


def test_it_is_read_again_as_it_was(tmp_path: Path, recording: Recording) -> None:
    write_matlab(tmp_path / "x.mat", recording, 1e-3, 8)
    got = read_recording(tmp_path / "x.mat")
    for name in ("voltages", "drive", "measure", "time", "labels"):
        assert np.array_equal(getattr(got, name), getattr(recording, name)), name
    assert (got.idle, got.reference, got.board_known) == (4, None, True)


def test_all_numbers_are_doubles(tmp_path: Path, recording: Recording) -> None:
    """In MATLAB and Octave a double divided by an integer is an integer: means would be 0."""
    whole = replace(
        recording,
        voltages=recording.voltages.astype(np.float32),
        reference=np.arange(PATTERN.n_meas),
        labels=np.zeros((10, 2), np.int64),
    )
    write_matlab(tmp_path / "x.mat", whole, 1e-3, 8)
    kinds = {name: kind for name, _, kind in whosmat(tmp_path / "x.mat")}
    assert set(kinds) == {"stimulation", "vi", "vh", "time_s", "idle", "xy_m", "board_known"}
    assert {kinds.pop("stimulation"), kinds.pop("board_known")} == {"struct", "logical"}
    assert set(kinds.values()) == {"double"}
    stimulation = loadmat(tmp_path / "x.mat", simplify_cells=True)["stimulation"][0]
    assert stimulation["stim_pattern"].dtype == stimulation["meas_pattern"].dtype == np.float64


@pytest.mark.slow
def test_a_damaged_one_is_refused_or_fits_together(tmp_path: Path, recording: Recording) -> None:
    base, damaged = tmp_path / "base.mat", tmp_path / "x.mat"
    write_matlab(base, recording, 1e-3, 8)
    refused = 0
    for number in range(COUNT):
        damaged.write_bytes(mutated(base.read_bytes(), number))
        try:
            found = read_recording(damaged)
        except DataError:
            refused += 1
        else:
            assert found.voltages.shape == (len(found.time), len(found.drive))
    assert refused > 0
