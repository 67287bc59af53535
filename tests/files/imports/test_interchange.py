"""The interchange file: what is written is read, and what cannot be meant is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tomoskin.core import DataError, PatternError
from tomoskin.files.imports import read_recording, write_interchange
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.signal import Recording

PATTERN = Pattern.adjacent(8)
RNG = np.random.default_rng(0)
RECORDING = Recording(
    voltages=RNG.random((3, 40)),
    drive=PATTERN.drive,
    measure=PATTERN.measure,
    time=np.array([0.0, 0.1, 0.3]),
    reference=RNG.random(40),
    labels=RNG.random((3, 2)),
    is_change=False,
    source="here",
)
BARE = replace(RECORDING, reference=None, labels=None)
FIELDS = ("voltages", "drive", "measure", "time", "reference", "labels", "is_change")


def written(path: Path, **arrays: Any) -> Path:
    whole = {
        "voltages": RECORDING.voltages,
        "drive": RECORDING.drive,
        "measure": RECORDING.measure,
        **arrays,
    }
    np.savez(path, **{k: v for k, v in whole.items() if v is not None})
    return path


@pytest.mark.parametrize(
    "recording",
    [
        RECORDING,
        BARE,
        replace(RECORDING, is_change=True),
        replace(BARE, voltages=RECORDING.voltages * (1 + 2j)),
        BARE.part(1, 2),
    ],
)
def test_round_trip(tmp_path: Path, recording: Recording) -> None:
    path = tmp_path / "x.npz"
    write_interchange(path, recording)
    got = read_recording(path)
    for field in FIELDS:
        assert np.array_equal(getattr(got, field), getattr(recording, field)), field
        assert type(getattr(got, field)) is type(getattr(recording, field))
    assert got.voltages.dtype == recording.voltages.dtype
    assert got.source == str(path)


def test_the_name_is_kept_as_given(tmp_path: Path) -> None:
    """numpy would append .npz."""
    write_interchange(tmp_path / "recording", RECORDING)
    assert [p.name for p in tmp_path.iterdir()] == ["recording"]


def test_one_frame_may_stand_alone(tmp_path: Path) -> None:
    got = read_recording(written(tmp_path / "x.npz", voltages=RECORDING.voltages[0]))
    assert np.array_equal(got.voltages, RECORDING.voltages[:1])
    assert got.time.tolist() == [0.0]


def test_integers_become_volts(tmp_path: Path) -> None:
    path = written(tmp_path / "x.npz", voltages=np.arange(40, dtype=np.int16))
    assert read_recording(path).voltages.dtype == np.float64


def test_unknown_keys_are_left_alone(tmp_path: Path) -> None:
    path = written(tmp_path / "x.npz", operator=np.array("me"))
    assert len(read_recording(path)) == 3


def test_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="expected the name of a file, got a folder") as caught:
        write_interchange(tmp_path, RECORDING)
    assert caught.value.where == str(tmp_path)


DRIVE, MEASURE = PATTERN.drive, PATTERN.measure


def spoilt(table: Any, row: int, value: Any) -> Any:
    out = table.astype(float)
    out[row] = value
    return out


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"dv": np.ones((3, 40))}, "holds both voltages and dv"),
        ({"voltages": None}, "got the keys drive, measure"),
        ({"drive": None}, "got the keys measure, voltages"),
        ({"voltages": np.full((3, 40), "1.0")}, "expected numbers in voltages, got <U3"),
        ({"voltages": np.zeros((3, 40), dtype="M8[s]")}, "expected numbers in voltages"),
        ({"voltages": np.empty((0, 40))}, "the recording is empty"),
        ({"voltages": np.empty((3, 0))}, "the recording is empty"),
        ({"voltages": np.empty(0)}, "the recording is empty"),
        ({"voltages": np.ones((3, 40, 2))}, r"expected voltages .*got shape \(3, 40, 2\)$"),
        ({"voltages": np.ones((3, 39))}, r"expected drive of shape \(39, 2\), got \(40, 2\)"),
        ({"voltages": np.float64(1)}, r"expected drive of shape \(1, 2\)"),
        ({"drive": DRIVE[:-1]}, r"expected drive of shape \(40, 2\), got \(39, 2\)"),
        ({"measure": MEASURE[1:]}, r"expected measure of shape \(40, 2\), got \(39, 2\)"),
        ({"drive": DRIVE.T}, r"expected drive of shape \(n_meas, 2\), got \(2, 40\)"),
        ({"drive": DRIVE[:, 0]}, r"expected drive of shape \(n_meas, 2\), got \(40,\)"),
        ({"drive": DRIVE.astype(str)}, "expected numbers in drive"),
        ({"drive": DRIVE * 1j}, "expected real numbers in drive"),
        ({"drive": spoilt(DRIVE, 3, 0.5)}, "drive row 3: expected whole electrode numbers"),
        ({"drive": spoilt(DRIVE, 3, np.nan)}, "drive row 3: expected whole electrode numbers"),
        ({"measure": spoilt(MEASURE, 9, -1)}, "measure row 9: expected whole electrode numbers"),
        ({"measure": spoilt(MEASURE, 9, 1e300)}, "measure row 9: expected whole"),
        ({"time_s": np.ones(2)}, r"expected time_s of shape \(3,\), got \(2,\)"),
        ({"time_s": np.full(3, "noon")}, "expected numbers in time_s"),
        ({"time_s": np.ones(3) * 1j}, "expected real numbers in time_s"),
        ({"reference": np.ones(39)}, r"expected reference of shape \(40,\), got \(39,\)"),
        ({"reference": np.ones((1, 40))}, r"expected reference of shape \(40,\)"),
        ({"idle": 4}, r"expected idle from 1 to 3, got 4"),
        ({"idle": np.ones(3)}, "expected one whole number .* as idle"),
        ({"xy_m": np.ones((3, 3))}, r"expected xy_m of shape \(3, 2\), got \(3, 3\)"),
        ({"xy_m": np.ones((3, 2)) * 1j}, "expected real numbers in xy_m"),
    ],
)
def test_refused(tmp_path: Path, arrays: dict[str, Any], message: str) -> None:
    path = written(tmp_path / "x.npz", **arrays)
    with pytest.raises(DataError, match=message) as caught:
        read_recording(path)
    assert caught.value.where.startswith(str(path))


def test_part() -> None:
    part = RECORDING.part(1, 3)
    assert len(part) == 2
    assert np.array_equal(part.voltages, RECORDING.voltages[1:])
    assert part.time.tolist() == [0.1, 0.3]
    assert np.array_equal(part.labels, RECORDING.labels[1:])  # type: ignore[index,arg-type]
    assert part.reference is RECORDING.reference


def test_an_empty_part_is_refused() -> None:
    with pytest.raises(DataError, match="the recording is empty"):
        RECORDING.part(3, 9)


def test_rows_in_any_order_come_in_that_of_the_pattern() -> None:
    order = np.random.default_rng(1).permutation(40)
    flip = np.arange(40) % 2 == 0
    drive = PATTERN.drive[order]
    drive[flip] = drive[flip][:, ::-1]
    sign = np.where(flip, -1.0, 1.0)
    foreign = replace(
        RECORDING,
        voltages=RECORDING.voltages[:, order] * sign,
        reference=RECORDING.reference[order] * sign,  # type: ignore[index]
        drive=drive,
        measure=PATTERN.measure[order],
    )
    got = foreign.in_order_of(PATTERN)
    for field in FIELDS:
        assert np.array_equal(getattr(got, field), getattr(RECORDING, field)), field


def test_a_skin_with_fewer_electrodes() -> None:
    wide = Pattern.adjacent(16)
    recording = replace(BARE, voltages=np.ones((3, 208)), drive=wide.drive, measure=wide.measure)
    with pytest.raises(DataError, match="uses electrodes E1 to E16, the skin has 8") as caught:
        recording.in_order_of(PATTERN)
    assert (caught.value.where, "--skin" in caught.value.hint) == ("here", True)


def test_missing_rows_name_the_recording() -> None:
    short = replace(
        BARE, voltages=np.ones((3, 5)), drive=PATTERN.drive[:5], measure=PATTERN.measure[:5]
    )
    with pytest.raises(PatternError, match="of 40 rows are not in the recording") as caught:
        short.in_order_of(PATTERN)
    assert caught.value.where == "here"


def test_impossible_rows_name_the_recording() -> None:
    drive = PATTERN.drive.copy()
    drive[4] = [2, 2]
    with pytest.raises(PatternError, match="source and sink are both E3") as caught:
        replace(BARE, drive=drive).in_order_of(PATTERN)
    assert caught.value.where == "here, drive row 4"
