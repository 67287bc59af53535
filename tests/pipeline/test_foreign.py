"""Recordings of boards that are not known: open electrodes, rows of zero, what chooses alpha."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tomoskin.core import DataError, FloatArray
from tomoskin.files.exports import plot
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Prepared, prepare, reconstruct
from tomoskin.pipeline.recorded import open_electrodes
from tomoskin.pipeline.rest import tuned_by_file
from tomoskin.sensing.signal import Recording, Reference


@cache
def prepared(difference: str = "plain", skin: str = "textile-disc-16") -> Prepared:
    changes = {
        "inverse": {"difference": difference},
        "drive": {"pattern": "opposite"},
        "touch": {"method": "image"},
        "mesh": {"cells": 600},
    }
    return prepare(Skin.load(skin).altered(changes))


def recording(made: Prepared, values: FloatArray) -> Recording:
    pattern = made.pattern
    time = np.arange(float(len(values)))
    drive, measure = pattern.drive, pattern.measure
    whole = Recording(values, drive, measure, time, values[0], None, False, "here", timed=False)
    return replace(whole, board_known=False)


def touched(made: Prepared) -> FloatArray:
    """The untouched skin, and one with less in a cell or two."""
    change = np.zeros(len(made.mesh.cells))
    change[np.linalg.norm(made.mesh.centroids - [0.03, 0.02], axis=1) < 0.012] = -0.2
    reference = made.problem.model.at(made.skin.conductivity)
    return np.array([reference.voltages, reference.voltages + reference.jacobian @ change])


@pytest.mark.parametrize("lost", [[], [3], [13, 14, 15]])
def test_electrodes_without_contact_are_named_and_left_out(lost: list[int]) -> None:
    """Their rows read anything, far above all others."""
    made = prepared()
    values = touched(made)
    rows = np.flatnonzero(
        np.isin(np.hstack([made.pattern.drive, made.pattern.measure]), lost).any(axis=1)
    )
    size = np.random.default_rng(1).uniform(3.0, 8.0, len(rows))
    values[:, rows] = np.abs(values).max() * np.exp(size)
    assert open_electrodes(made.pattern, values[0], made.problem.reference) == lost
    found = reconstruct(made, recording(made, values), values[:1])
    assert found.rows_left_out.tolist() == rows.tolist()
    names = ", ".join(f"E{e + 1}" for e in lost)
    assert [note.split(" read")[0] for note in found.notes] == ([names] if lost else [])
    place = made.mesh.centroids[found.images[1].argmin()]
    assert np.linalg.norm(place - [0.03, 0.02]) < 0.02


def test_what_fits_the_model_to_a_factor_is_not_open() -> None:
    made = prepared()
    rng = np.random.default_rng(2)
    values = touched(made)[0] * rng.uniform(0.4, 2.0, made.pattern.n_meas)
    assert open_electrodes(made.pattern, 1e5 * values, made.problem.reference) == []


def test_rows_of_zero_are_left_out_where_they_would_divide() -> None:
    values = touched(prepared())
    values[:, 5] = 0.0
    for difference, left_out in (("normalised", [5]), ("plain", [])):
        made = prepared(difference)
        found = reconstruct(made, recording(made, values), values[:1])
        assert found.rows_left_out.tolist() == left_out
        assert [note.split(",")[0] for note in found.notes] == (
            ["1 rows are zero in the reference"] if left_out else []
        )
        assert np.isfinite(found.images).all()


def test_a_board_that_is_not_known_has_no_noise_to_predict() -> None:
    """The skin's own read-out chooses only for what it has recorded itself."""
    made = prepared()
    values = touched(made)
    rules = []
    for known in (False, True):
        one = replace(recording(made, values), board_known=known)
        rules.append(reconstruct(made, one, values[:1]).choice.rule)
    assert rules == ["model-error", "light-touch"]


def test_changes_in_common_show_unless_idle_frames_have_them_too() -> None:
    made = prepared()
    rng = np.random.default_rng(3)
    voltages = touched(made)[0]
    noise = 1e-3 * np.abs(voltages).mean() * rng.standard_normal((20, len(voltages)))
    for gain, expected in ((0.0, "kept"), (0.02, "projected")):
        idle = voltages * (1.0 + gain * rng.standard_normal((20, 1))) + noise
        tuned = tuned_by_file(made, Reference.of(idle), voltages - idle[:1])
        assert tuned.skin.signal.common_modes == expected
    single = tuned_by_file(made, Reference.of(voltages[None]), noise)
    assert single.skin.signal.common_modes == "kept"
    assert made.skin.signal.common_modes == "projected"


def test_normalised_rows_that_read_next_to_nothing_do_not_rule_the_image() -> None:
    made = prepared("normalised")
    values = touched(made)
    values[0, [7, 40]] *= 1e-4
    found = reconstruct(made, recording(made, values), values[:1])
    place = made.mesh.centroids[found.images[1].argmin()]
    assert np.linalg.norm(place - [0.03, 0.02]) < 0.02


def test_arrays_are_told_what_is_wanted() -> None:
    made = prepared()
    values = touched(made)
    with pytest.raises(DataError, match="expected a Recording, got ndarray") as caught:
        reconstruct(made, values, values[:1])  # type: ignore[arg-type]
    assert "read_recording(file).in_order_of(pattern)" in str(caught.value)
    with pytest.raises(DataError, match="expected an Image and its Mesh, got ndarray and Mesh"):
        plot(values, made.mesh)  # type: ignore[arg-type]
