"""The main job on real input: EIDORS' tank recordings, from file to touches."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tomoskin.cli import main
from tomoskin.core import FloatArray
from tomoskin.files.imports import read_recording
from tomoskin.model.skin import Skin
from tomoskin.pipeline import Reconstruction, prepare, reconstruct

pytest.importorskip("tomoskin.extras.greit", reason="the tank is a skin of another extra")

pytestmark = pytest.mark.data

RADIUS = 0.15
NEAR = 0.08 * 2 * RADIUS
"""A target is found when a touch lies within 8 % of the tank's diameter of it."""


@pytest.fixture
def tanks(data_dir: Path) -> Path:
    return data_dir / "eidors_tanks16"


def touches_of(path: Path) -> dict[int, FloatArray]:
    with path.open() as file:
        rows = [(int(r["frame"]), float(r["x_m"]), float(r["y_m"])) for r in csv.DictReader(file)]
    frames = {frame for frame, _, _ in rows}
    return {f: np.array([(x, y) for frame, x, y in rows if frame == f]) for f in frames}


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as exit_:
        main(["image", *arguments])
    return int(exit_.value.code or 0)


def test_each_golf_ball_is_where_it_lay(tanks: Path, tmp_path: Path) -> None:
    source = tanks / "ottawa2005_golfball_ph3.npz"
    table, picture = tmp_path / "touches.csv", tmp_path / "balls.png"
    code = run(str(source), "--skin", "tank-16", "--reference", "first:1",
               "--touches", str(table), "--out", str(picture))  # fmt: skip
    assert code == 0
    assert picture.stat().st_size > 10_000
    found = touches_of(table)
    with np.load(source) as truth:
        balls = 1e-3 * truth["ball_xy_mm"]
    assert 0 not in found  # the empty tank
    for frame in range(1, len(balls)):
        known = balls[frame][np.isfinite(balls[frame]).all(axis=1)]
        distance = np.linalg.norm(found[frame][:, None] - known[None], axis=2)
        assert len(found[frame]) == len(known)
        assert distance.min(axis=0).max() < NEAR, f"frame {frame}: {found[frame]}"


@pytest.mark.parametrize(
    ("name", "reference"),
    [("ottawa2005_moving_ball_series", "first:1"), ("montreal1995_rod_circle", None)],
)
def test_every_series_gives_a_table(
    tanks: Path, tmp_path: Path, name: str, reference: str | None
) -> None:
    table = tmp_path / "touches.csv"
    chosen = () if reference is None else ("--reference", reference)
    assert (
        run(str(tanks / f"{name}.npz"), "--skin", "tank-16", "--touches", str(table), *chosen) == 0
    )
    found = touches_of(table)
    with np.load(tanks / f"{name}.npz") as recording:
        assert len(found) > 0.9 * len(recording["v"])
    assert all(np.hypot(*place.T).max() < RADIUS for place in found.values())


def test_the_moving_ball_is_one_body_on_a_path(tanks: Path) -> None:
    """Its layout is packed; read wrongly, the reference would not look like a tank."""
    found = images(tanks / "ottawa2005_moving_ball_series.npz", Skin.load("tank-16"), 0)
    assert found.agreement > 0.95
    assert np.mean([len(touches) == 1 for touches in found.touches[1:]]) > 0.9


@pytest.mark.parametrize(
    "name",
    [pytest.param("iirc2006_rotating_rod", marks=pytest.mark.slow), "montreal1995_rod_circle"],
)
def test_a_target_carried_round_is_seen_to_go_round(tanks: Path, name: str) -> None:
    found = images(tanks / f"{name}.npz", Skin.load("tank-16"), None)
    places = np.array([(t[0].detection.x, t[0].detection.y) for t in found.touches if t])
    assert len(places) >= 79  # a touch of the image is believed in its second frame
    steps = np.diff(np.unwrap(np.arctan2(places[:, 1], places[:, 0])))
    assert abs(steps.sum()) > 2 * np.pi * 0.7
    assert np.mean(np.sign(steps) == np.sign(steps.sum())) > 0.95
    assert np.ptp(np.hypot(*places.T)) < 0.3 * RADIUS


@pytest.mark.parametrize(
    ("reference", "frame", "sign"),
    [
        pytest.param(0, 1, "decrease", marks=pytest.mark.slow),
        (0, 2, "increase"),
        (3, 4, "decrease"),
        pytest.param(3, 5, "increase", marks=pytest.mark.slow),
    ],
)
def test_targets_in_the_deformed_tank(tanks: Path, reference: int, frame: int, sign: str) -> None:
    """Glass (a large body) and metal, in the round tank and in the squeezed one.

    The electrodes' places come from photographs; the bath's own drift is as large as the metal's
    effect, so the sign of the target is given.
    """
    source = tanks / "ottawa2008_deformed.npz"
    with np.load(source) as truth:
        electrodes, target = truth["electrode_xy"][frame], truth["target_xy"][frame]
    skin = tank_of(electrodes).altered({"touch": {"sign": sign}})
    found = images(source, skin, reference, slice(frame, frame + 1))
    first = found.touches[0][0].detection
    assert np.hypot(first.x - RADIUS * target[0], first.y - RADIUS * target[1]) < NEAR


def images(
    path: Path, skin: Skin, reference: int | None, frames: slice = slice(None)
) -> Reconstruction:
    prepared = prepare(skin)
    whole = read_recording(path).in_order_of(prepared.pattern)
    if reference is None:
        assert whole.reference is not None
        idle = whole.reference[None]
    else:
        idle = whole.voltages[reference : reference + 1]
    part = whole.part(frames.start or 0, frames.stop or len(whole))
    return reconstruct(prepared, part, idle)


def tank_of(electrodes: FloatArray) -> Skin:
    """Tank with a smooth rim through 16 electrodes, counter-clockwise in the file from E16 on."""
    place = RADIUS * electrodes[::-1]
    spline = CubicSpline(np.arange(17), np.vstack([place, place[:1]]), bc_type="periodic")
    rim = spline(np.arange(128) / 8)

    def written(points: FloatArray) -> list[list[str]]:
        return [[f"{1e3 * c:.4f} mm" for c in point] for point in points]

    none = dict.fromkeys(("count", "first", "order"))
    return Skin.load("tank-16").altered(
        {
            "outline": {"shape": "polygon", "diameter": None, "vertices": written(rim)},
            "electrodes": none | {"positions": written(rim[::8])},
        }
    )
