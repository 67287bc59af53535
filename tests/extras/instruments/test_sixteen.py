"""Import of 256-value tanks: layout, polarity and numbering are told from the data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from oracles import disc_points
from tomoskin.core import DataError, FloatArray, IntArray
from tomoskin.files.imports import read_recording
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Disc, ElectrodeArc, triangulate
from tomoskin.model.pattern import Pattern
from tomoskin.sensing.signal import Recording, difference, in_phase

N = 16
PATTERN = Pattern.adjacent(N)
E = np.arange(N)
PAIR = np.column_stack([E, (E + 1) % N])
INJ, MEAS = PAIR[np.repeat(E, N)], PAIR[np.tile(E, N)]
VALID = ~(INJ[:, :, None] == MEAS[:, None, :]).any(axis=(1, 2))


def rim(first: float, step: float) -> FloatArray:
    """(16, 2) unit circle: electrode k at ``first`` + k·``step`` electrode spacings from +x."""
    angle = 2 * np.pi * (first + step * E) / N
    return np.column_stack([np.cos(angle), np.sin(angle)])


def scan(place: FloatArray, drive: IntArray, measure: IntArray) -> FloatArray:
    """Voltages of a round tank between point electrodes, current into ``drive``'s first."""
    out = [
        np.diff(disc_points(1.0, place[s], place[k], place[m[::-1]])).item()
        for (s, k), m in zip(drive, measure, strict=True)
    ]
    return np.array(out)


def full(place: FloatArray) -> FloatArray:
    """(256,) in the file's order: sink k, source k + 1, φ[j] − φ[j + 1]; junk where not valid."""
    frame = np.random.default_rng(0).uniform(-5, 5, N * N)
    frame[VALID] = scan(place, INJ[VALID][:, ::-1], MEAS[VALID])
    return frame


def packed(place: FloatArray) -> FloatArray:
    """(256,): 13 values a drive from the pair behind the driven one on, then 48 of junk."""
    frame = np.random.default_rng(1).uniform(-5, 5, N * N)
    for k in range(N):
        j = (k + 2 + np.arange(N - 3)) % N
        drive = np.tile(PAIR[k][::-1], (N - 3, 1))
        frame[k * (N - 3) : (k + 1) * (N - 3)] = scan(place, drive, PAIR[j])
    return frame


LAYOUTS = {"full": full, "packed": packed}


def tank(path: Path, frames: NDArray[Any], **more: Any) -> Path:
    np.savez(path, **{"v": frames, "inj": INJ, "meas": MEAS, "valid": VALID, **more})
    return path


def seen_by_the_built_in_tank(first: float = 4, step: float = -1) -> FloatArray:
    """(208,) what the tank with E1 at the top, clockwise, measures."""
    return scan(rim(first, step), PATTERN.drive, PATTERN.measure)


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("polarity", [1, -1])
@pytest.mark.parametrize("gain", [1.0, 2000.0])
def test_layout_and_polarity(tmp_path: Path, layout: str, polarity: int, gain: float) -> None:
    # a tank that is not round, so that a wrong numbering shows
    stretched = rim(0, 1) * [1.0, 0.7]
    frame = LAYOUTS[layout](stretched)
    recording = read_recording(tank(tmp_path / "x.npz", polarity * gain * frame))
    got = recording.in_order_of(PATTERN).voltages[0]
    own = rim(4, -1) * [1.0, 0.7]
    assert got == pytest.approx(gain * scan(own, PATTERN.drive, PATTERN.measure), rel=1e-9)
    assert len(recording) == 1
    assert recording.voltages.shape == (1, 208)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_reference_and_frames_share_the_layout(tmp_path: Path, layout: str) -> None:
    frame = LAYOUTS[layout](rim(0, 1))
    path = tank(tmp_path / "x.npz", np.stack([frame, 2 * frame]), v_ref=3 * frame, fps=7.0)
    got = read_recording(path)
    assert got.reference == pytest.approx(3 * got.voltages[0])
    assert got.voltages[1] == pytest.approx(2 * got.voltages[0])
    assert got.time.tolist() == [0.0, 1 / 7]


@pytest.mark.parametrize("first", [0, 0.3, 3, 7.5, 12, 15.9])
@pytest.mark.parametrize("step", [1, -1])
def test_numbering_follows_the_electrodes_positions(
    tmp_path: Path, first: float, step: int
) -> None:
    """Whatever electrode the file counts first, the number is that of the nearest built-in one."""
    place = rim(first, step)
    path = tank(tmp_path / "x.npz", full(place), electrode_xy=0.2 * place + 1.0)
    recording = read_recording(path)
    built_in = rim(4, -1)
    for k, number in zip(INJ[VALID][:, 0], recording.drive[:, 1], strict=True):
        gap = np.linalg.norm(place[k] - built_in[number])
        assert gap <= 2 * np.sin(np.pi / N / 2) + 1e-9


def test_without_positions_the_first_electrode_is_towards_x(tmp_path: Path) -> None:
    """Electrode 0 of the file at +x is E5 of the built-in tank; its neighbour is E4."""
    recording = read_recording(tank(tmp_path / "x.npz", full(rim(0, 1))))
    assert recording.drive[0].tolist() == [3, 4]


def test_junk_in_what_is_not_valid_is_not_seen(tmp_path: Path) -> None:
    frame = full(rim(0, 1))
    frame[~VALID] = np.nan
    got = read_recording(tank(tmp_path / "x.npz", frame)).in_order_of(PATTERN)
    assert got.voltages[0] == pytest.approx(seen_by_the_built_in_tank())


GOOD = full(rim(0, 1))


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"v": np.ones((2, 208))}, r"expected a frame of v of shape \(256,\), got \(208,\)"),
        ({"v": np.ones((2, 256, 2))}, r"expected frames v \(n, 256\), got \(2, 256, 2\)"),
        ({"v": np.empty((0, 256))}, r"expected frames v \(n, 256\), got \(0, 256\)"),
        ({"v": np.full(256, "x")}, "expected numbers in v"),
        ({"v": np.zeros(256)}, "holds no signal"),
        ({"v": np.full(256, np.nan)}, "holds no signal"),
        ({"valid": np.zeros(256, dtype=bool)}, "holds no signal"),
        ({"valid": VALID[:208]}, r"expected valid of shape \(256,\), got \(208,\)"),
        ({"valid": np.full(256, "yes")}, "expected numbers in valid"),
        ({"inj": INJ[:208]}, r"expected inj of shape \(256, 2\), got \(208, 2\)"),
        (
            {"meas": MEAS + 1},
            r"meas row 14: expected electrodes from 0 \(E1\) to 15, got \[15, 16\]",
        ),
        ({"inj": INJ - 1}, "inj row 0: expected whole electrode numbers from 0"),
        ({"v_ref": np.ones(208)}, r"expected v_ref of shape \(256,\), got \(208,\)"),
        ({"fps": 0.0}, "expected one fps above 0, got 0.0"),
        ({"fps": np.nan}, "expected one fps above 0, got nan"),
        ({"fps": [1.0, 2.0]}, "expected one fps above 0"),
        ({"fps": "seven"}, "expected numbers in fps"),
        ({"electrode_xy": np.ones((15, 2))}, "expected finite positions electrode_xy"),
        ({"electrode_xy": np.full((16, 2), np.nan)}, "expected finite positions electrode_xy"),
    ],
)
def test_refused(tmp_path: Path, arrays: dict[str, Any], message: str) -> None:
    path = tank(tmp_path / "x.npz", **{"frames": GOOD, **arrays})
    if "v" not in arrays:
        path = tank(tmp_path / "x.npz", GOOD, **arrays)
    with pytest.raises(DataError, match=message) as caught:
        read_recording(path)
    assert caught.value.where.startswith(str(path))


# Real recordings.


@pytest.fixture(scope="module")
def tanks(data_dir: Path) -> Path:
    return data_dir / "eidors_tanks16"


def real(tanks: Path, name: str) -> Recording:
    return read_recording(tanks / f"{name}.npz").in_order_of(PATTERN)


@pytest.fixture(scope="module")
def operator() -> OneStep:
    """Unit disc with small electrodes, E1 at the top, clockwise."""
    outline = Disc(1.0)
    arcs = [ElectrodeArc.around((0.25 - k / N) * outline.length, 0.1) for k in range(N)]
    model = ForwardModel(triangulate(outline, arcs, 900), PATTERN, contact_impedance=0.01)
    return OneStep(model, "noser", alpha=0.01, difference="normalised")


def centroid(operator: OneStep, frame: FloatArray, reference: FloatArray) -> FloatArray:
    """(2,) centroid of the strongest half of the image, in tank radii."""
    image = operator(difference(frame, reference, "normalised")).values
    strength = np.abs(image)
    weight = np.where(strength > 0.5 * strength.max(), strength, 0.0)
    mesh = operator.model.mesh
    weight *= mesh.volumes
    return np.asarray(weight @ mesh.centroids / weight.sum())


REAL = [
    "ottawa2005_golfball_ph3",
    "ottawa2005_moving_ball_series",
    "ottawa2008_deformed",
    "iirc2006_rotating_rod",
]
"""The Montreal recording is left out where absolute values count: each row has its own gain."""


@pytest.mark.data
@pytest.mark.parametrize("name", REAL)
def test_real_tanks_are_reciprocal_and_positive(tanks: Path, name: str) -> None:
    recording = real(tanks, name)
    mean = recording.voltages.mean(axis=0)
    assert (mean.real > 0).mean() > 0.98
    table = {
        (d, m): v
        for d, m, v in zip(
            PATTERN.drives[PATTERN.drive_index][:, 1].tolist(),
            PATTERN.measure[:, 0].tolist(),
            mean,
            strict=True,
        )
    }
    mismatch = [abs(v - table[m, d]) / abs(v) for (d, m), v in table.items()]
    assert np.median(mismatch) < 0.06


@pytest.mark.data
@pytest.mark.parametrize("name", REAL)
def test_real_tanks_resemble_a_disc(tanks: Path, operator: OneStep, name: str) -> None:
    """U-shaped curves of the right drives: a wrong layout or numbering of pairs has none."""
    mean = real(tanks, name).voltages[0].real
    assert np.corrcoef(mean, operator.reference)[0, 1] > 0.9


@pytest.mark.data
def test_golf_ball_stands_where_it_was_put(tanks: Path, operator: OneStep) -> None:
    with np.load(tanks / "ottawa2005_golfball_ph3.npz") as file:
        truth = file["ball_xy_mm"] / file["tank_radius_mm"]
    recording = real(tanks, "ottawa2005_golfball_ph3")
    empty, *balls = recording.voltages
    centre, north, _both = (centroid(operator, ball, empty) for ball in balls)
    # 8 % of the diameter
    assert np.linalg.norm(centre - truth[1, 0]) < 0.16
    assert np.linalg.norm(north - truth[2, 0]) < 0.16
    angle = np.degrees(np.arctan2(*north[::-1]))
    assert angle == pytest.approx(90.0, abs=8.0)
    # the second ball alone: against the frame with the first one
    west = centroid(operator, balls[2], balls[1])
    assert np.linalg.norm(west - truth[3, 1]) < 0.16
    assert abs(np.degrees(np.arctan2(*west[::-1]))) == pytest.approx(180.0, abs=8.0)


@pytest.mark.data
def test_moving_ball_moves_smoothly(tanks: Path, operator: OneStep) -> None:
    """The series is packed: read as a full scan, no picture hangs together."""
    recording = real(tanks, "ottawa2005_moving_ball_series")
    with np.load(tanks / "ottawa2005_moving_ball_series.npz") as file:
        raw = file["v"]
    assert recording.voltages.min(initial=np.inf) in raw[:, :208]
    reference = recording.voltages.mean(axis=0)
    path = np.stack([centroid(operator, f, reference) for f in recording.voltages[200:320:4]])
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    assert np.median(steps) < 0.25
    assert np.ptp(path, axis=0).max() > 0.5


@pytest.mark.data
@pytest.mark.parametrize("name", ["iirc2006_rotating_rod", "montreal1995_rod_circle"])
def test_rods_are_carried_round_the_tank(tanks: Path, operator: OneStep, name: str) -> None:
    recording = real(tanks, name)
    assert recording.reference is not None
    values, reference = in_phase(recording.voltages, recording.reference, operator.reference)
    path = np.stack([centroid(operator, frame, reference) for frame in values])
    turn = np.unwrap(np.arctan2(path[:, 1], path[:, 0]))
    assert np.median(np.linalg.norm(path, axis=1)) > 0.3
    assert abs(turn[-1] - turn[0]) > 1.5 * np.pi
    assert np.median(np.abs(np.diff(turn))) < 0.3


@pytest.mark.data
def test_targets_in_the_deformed_tank(tanks: Path, operator: OneStep) -> None:
    """Round tank only: metal where the photographs show it, the weaker glass near it.

    The import moves each electrode to the nearest place of the built-in tank; the pictures
    are turned back by what is left.
    """
    with np.load(tanks / "ottawa2008_deformed.npz") as file:
        round_tank = file["compression_points"] == 0
        target, place = file["target"], file["target_xy"]
        electrodes = file["electrode_xy"][0] @ [1, 1j]
    recording = real(tanks, "ottawa2008_deformed")
    empty = recording.voltages[round_tank & (target == "none")][0]
    built_in = rim(4, -1)[::-1] @ [1, 1j]
    turn = np.mean(electrodes / built_in)
    turn /= abs(turn)
    for frame in np.flatnonzero(round_tank & (target != "none")):
        got = centroid(operator, recording.voltages[frame], empty) @ [1, 1j] * turn
        error = abs(got - place[frame] @ [1, 1j])
        assert error < {"metal": 0.16, "glass": 0.3}[target[frame]]
