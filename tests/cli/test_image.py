"""``tomoskin image`` on files that a model wrote: references, outputs, refusals."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from PIL import Image

from core.seeing import blue_beside_red
from tomoskin.core import FloatArray
from tomoskin.files import imports
from tomoskin.files.exports.picture import circular_average
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import triangulate
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin

PLACE = (0.03, 0.04)
SKIN = Skin.load("textile-disc-8")


@pytest.fixture(scope="module")
def frames() -> FloatArray:
    """Three idle frames with noise, then one pressed at PLACE; on a mesh of its own."""
    mesh = triangulate(SKIN.outline, SKIN.arcs, 1100, seed=11)
    model = ForwardModel(mesh, SKIN.pattern(), SKIN.contact_impedance, SKIN.current)
    near = np.hypot(*(mesh.centroids - PLACE).T) < 0.015
    sigma = np.where(near, 0.7, 1.0) * SKIN.conductivity
    idle = model.solve(SKIN.conductivity).voltages
    noise = np.random.default_rng(3).normal(0.0, 5e-6, (4, len(idle)))
    return np.vstack([idle, idle, idle, model.solve(sigma).voltages]) + noise


@pytest.fixture
def save(tmp_path: Path, frames: FloatArray) -> Callable[..., str]:
    def write(name: str = "recording.npz", **changes: Any) -> str:
        pattern = SKIN.pattern()
        arrays = {"voltages": frames, "drive": pattern.drive, "measure": pattern.measure}
        arrays |= changes
        path = tmp_path / name
        np.savez(path, **{k: v for k, v in arrays.items() if v is not None})
        return str(path)

    return write


@pytest.fixture
def image(tomoskin: Callable[..., tuple[int, str, str]]) -> Callable[..., tuple[int, str, str]]:
    return partial(tomoskin, "image")


def places(path: Path) -> dict[int, tuple[float, float]]:
    with path.open() as file:
        return {int(r["frame"]): (float(r["x_m"]), float(r["y_m"])) for r in csv.DictReader(file)}


@pytest.mark.parametrize("reference", ["first:3", "frame:1", None])
def test_a_press_is_found_where_it_was(save, image, tmp_path, reference) -> None:
    table = tmp_path / "touches.csv"
    chosen = () if reference is None else ("--reference", reference)
    code, _, err = image(save(), "--touches", table, "--frames", "3:4", *chosen)
    assert (code, err) == (0, "")
    assert np.hypot(*np.subtract(places(table)[3], PLACE)) < 0.012


def test_a_file_that_is_the_reference_is_read_once(
    save, image, frames, tmp_path, monkeypatch
) -> None:
    """Whatever is made of the frames: images, a longer search."""
    read, own = [], imports.read_recording

    def noted(path):
        read.append(path)
        return own(path)

    monkeypatch.setattr(imports, "read_recording", noted)
    idle = save("idle.npz", voltages=frames[:3])
    ways = "--thorough", tmp_path / "all.csv"
    assert image(save(), "--reference", idle, "--frames", "3:4", *ways)[0] == 0
    assert read.count(Path(idle)) == 1


def test_currents_into_many_electrodes(save, image, tmp_path) -> None:
    """Cosines of all electrodes: the same press, of files with all they need and with too few."""
    angle, ring = 2.0 * np.pi * np.arange(8) / 8, [[e, (e + 1) % 8] for e in range(8)]
    waves = [f(k * angle + 0.1) for k in range(1, 5) for f in (np.cos, np.sin)][:7]
    pattern = Pattern.from_pairs(8, waves, ring, include_driven=True)
    mesh = triangulate(SKIN.outline, SKIN.arcs, 1100, seed=11)
    model = ForwardModel(mesh, pattern, SKIN.contact_impedance, SKIN.current)
    near = np.hypot(*(mesh.centroids - PLACE).T) < 0.015
    sigma = np.where(near, 0.7, 1.0) * SKIN.conductivity
    values = np.array([model.solve(SKIN.conductivity).voltages, model.solve(sigma).voltages])
    rows = {"voltages": values, "drive": pattern.drive, "measure": pattern.measure}
    table = tmp_path / "touches.csv"
    code, _, err = image(save(**rows), "--touches", table)
    assert code == 0
    assert "56 rows with drives of several electrodes were summed to pairs" in err
    assert np.hypot(*np.subtract(places(table)[1], PLACE)) < 0.012
    few = {key: value[..., :40] if key == "voltages" else value[:40] for key, value in rows.items()}
    code, _, err = image(save(**few))
    assert code == 1
    assert "40 of 40 rows are not in the recording: row 0: source E2, sink E1" in err
    leak = save(**rows | {"drive": pattern.drive + 0.01})
    assert "drive row 0: expected currents that are not all zero and sum to zero" in image(leak)[2]


def test_idle_frames_with_known_noise_give_no_touch(save, image, tmp_path) -> None:
    table = tmp_path / "touches.csv"
    assert image(save(), "--reference", "first:3", "--touches", table)[0] == 0
    assert set(places(table)) == {3}
    header = table.read_text().splitlines()[0]
    assert header == "frame,time_s,id,x_m,y_m,sd_x_m,sd_y_m,area_m2,peak,kind"


def test_reference_from_a_file_or_in_the_file(save, image, tmp_path, frames) -> None:
    """Nearly the same: only the first tells the noise, by which measurements are weighed."""
    image = partial(image, "--alpha", "0.05")
    idle = save("idle.npz", voltages=frames[:3])
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    assert image(save("a.npz", voltages=frames[3:]), "--reference", idle, "--touches", one)[0] == 0
    inside = save("b.npz", voltages=frames[3:], reference=frames[:3].mean(axis=0))
    assert image(inside, "--touches", two)[0] == 0
    np.testing.assert_allclose(places(one)[0], places(two)[0], atol=1e-3)


def test_differences_need_no_reference(save, image, tmp_path, frames) -> None:
    path = save("dv.npz", voltages=None, dv=frames[3:] - frames[:3].mean(axis=0))
    table = tmp_path / "touches.csv"
    assert image(path, "--touches", table)[0] == 0
    assert np.hypot(*np.subtract(places(table)[0], PLACE)) < 0.012
    code, _, err = image(path, "--reference", "first:1")
    assert code == 1
    assert "holds differences" in err


def test_rows_in_any_order_and_sign(save, image, tmp_path, frames) -> None:
    rng = np.random.default_rng(1)
    order = rng.permutation(frames.shape[1])
    pattern, flip = SKIN.pattern(), rng.choice([False, True], frames.shape[1])
    measure = np.where(flip[:, None], pattern.measure[:, ::-1], pattern.measure)[order]
    mixed = (frames * np.where(flip, -1.0, 1.0))[:, order]
    one, two = tmp_path / "one.csv", tmp_path / "two.csv"
    image(save("a.npz"), "--touches", one)
    image(save("b.npz", voltages=mixed, drive=pattern.drive[order], measure=measure),
          "--touches", two)  # fmt: skip
    np.testing.assert_allclose(places(one)[3], places(two)[3], atol=1e-9)


def test_every_kind_of_output(save, image, tmp_path) -> None:
    recording = save()
    for name in ("maps.png", "maps.npz", "maps.vtu"):
        assert image(recording, "--out", tmp_path / name)[0] == 0
    assert (tmp_path / "maps.png").read_bytes()[:4] == b"\x89PNG"
    with np.load(tmp_path / "maps.npz") as found:
        assert found["images"].shape == (4, len(found["cells"]))
        assert str(found["unit"]) == "S"
        left = found["unresolved"]
        assert left.shape == (len(found["cells"]),)
        assert 0.02 < found["unresolved_radius_m"] * 1.1 < 0.03
    assert 0.3 < left.min() < left.max() < 1
    grid = ElementTree.parse(tmp_path / "maps.vtu").getroot()
    fields = grid.findall(".//CellData/DataArray")
    assert [field.get("Name") for field in fields][3:] == ["frame_000003", "unresolved"]
    assert len(fields) == 5


@pytest.mark.parametrize("side", [-1, 1])
def test_a_fall_is_drawn_in_blue_and_a_rise_in_red(save, image, tmp_path, side) -> None:
    """A sheet that conducts less on that side, and more on the other one."""
    mesh = triangulate(SKIN.outline, SKIN.arcs, 900, seed=5)
    model = ForwardModel(mesh, SKIN.pattern(), SKIN.contact_impedance, SKIN.current)
    idle = model.solve(SKIN.conductivity).voltages
    sigma = np.full(len(mesh.cells), SKIN.conductivity)
    for x, factor in ((0.05 * side, 0.7), (-0.05 * side, 1.4)):
        sigma[np.hypot(*(mesh.centroids - (x, 0.0)).T) < 0.025] *= factor
    recording = save(voltages=np.vstack([idle, model.solve(sigma).voltages]))
    picture = tmp_path / "map.png"
    options = ("--reference", "first:1", "--frames", "1:2", "--out", picture)
    assert image(recording, *options)[0] == 0
    assert blue_beside_red(Image.open(picture).convert("RGB")) == (side < 0)


def test_per_cent_and_averaged_for_the_eye_alone(save, image, tmp_path) -> None:
    """The files show what the options say; the touches stay as they are."""
    plain, shown = tmp_path / "plain.npz", tmp_path / "shown.npz"
    tables = [tmp_path / "one.csv", tmp_path / "two.csv"]
    assert image(save(), "--out", plain, "--touches", tables[0])[0] == 0
    options = ("--percent", "--smooth", "8 mm", "--limit", "5")
    assert image(save(), "--out", shown, "--touches", tables[1], *options)[0] == 0
    before, after = (np.load(path) for path in (plain, shown))
    assert (str(before["unit"]), str(after["unit"])) == ("S", "relative")
    average = circular_average(SKIN.mesh(), 0.008) / SKIN.conductivity
    assert after["images"] == pytest.approx(before["images"] @ average.T)
    assert tables[0].read_text() == tables[1].read_text()
    assert image(save(), "--out", tmp_path / "shown.png", *options)[0] == 0


def test_the_terminal_says_each_touch_once(save, image, frames) -> None:
    """With its beginning, its end and its place, whatever stands before and after it."""
    thrice = np.vstack([frames[:3], *(3 * [frames[3:]]), frames[:2]])
    code, out, _ = image(save(voltages=thrice), "--reference", "first:3")
    (line,) = (line for line in out.splitlines() if line.startswith("touch"))
    assert code == 0
    assert "8 frames, 1 touch\n" in out
    assert "3.00 to   5.00 s" in line
    x, y = map(float, re.findall(r" [xy] +([-+0-9.]+) mm", line))
    assert np.hypot(*np.subtract((1e-3 * x, 1e-3 * y), PLACE)) < 0.012


def test_json_says_the_same(save, image) -> None:
    code, out, _ = image(save(), "--json")
    found = json.loads(out)
    assert code == 0
    assert found["frames"] == 4
    assert [t["frame"] for t in found["touches"]][-1] == 3
    assert {t["id"] for t in found["touches"]} == {span["id"] for span in found["spans"]}
    assert found["agreement"] > 0.99


def test_a_dead_channel_is_left_out_and_named(save, image, tmp_path, frames) -> None:
    broken = frames.copy()
    rows = SKIN.pattern().rows_of(6)[:10]
    broken[:, rows] = np.nan
    table = tmp_path / "touches.csv"
    code, _, err = image(save(voltages=broken), "--touches", table)
    assert code == 0
    assert "10 rows hold no finite values and were left out" in err
    assert all(SKIN.pattern().row_text(row) in err for row in rows)
    assert math.dist(places(table)[3], PLACE) < 0.015


def test_too_many_dead_channels_are_refused(save, image, frames) -> None:
    broken = frames.copy()
    broken[:, :11] = np.nan
    code, _, err = image(save(voltages=broken))
    assert code == 1
    assert (
        "11 of 40 rows hold no finite values, which is too many to leave out: row 0: source" in err
    )


def test_a_frame_without_some_rows_is_imaged_without_them_and_named(
    save, image, tmp_path, frames
) -> None:
    broken = frames.copy()
    broken[3, SKIN.pattern().rows_of(6)[:3]] = np.nan
    broken[1, 5] = np.inf
    table = tmp_path / "touches.csv"
    code, out, err = image(save(voltages=broken), "--touches", table)
    assert code == 0
    assert "2 frames hold values that are not finite; these rows were left out" in err
    assert "1 (1 row), 3 (3 rows)\n" in err
    assert math.dist(places(table)[3], PLACE) < 0.015
    assert out.startswith("4 frames")
    assert json.loads(image(save(voltages=broken), "--json")[1])["rows_missing"] == {
        "1": 1,
        "3": 3,
    }


def test_how_well_the_reference_agrees_is_said(save, image, frames) -> None:
    code, out, _ = image(save(voltages=6 * frames))
    assert code == 0
    assert "agrees with the skin's model by 1.000 (1 = proportional), at 6 times its size" in out
    document = json.loads(image(save(), "--json")[1])
    assert document["agreement"] == pytest.approx(1.0, abs=1e-3)
    assert document["size"] == pytest.approx(1.0, abs=0.02)


def test_absurd_values_are_excluded_and_named(save, image, frames, tmp_path) -> None:
    """Without a warning of numpy, which the tests take for an error."""
    whole, table = tmp_path / "whole.csv", tmp_path / "touches.csv"
    image(save(time_s=np.arange(4) / 10), "--reference", "first:3", "--touches", whole)
    broken = np.vstack([frames, frames[3], frames[3]])
    broken[4], broken[5, 7] = 1e300, -100.0
    time = [0.0, 0.1, 0.2, 1e300, 0.4, 0.5]
    path = save(voltages=broken, time_s=time)
    code, _, err = image(path, "--reference", "first:3", "--touches", table)
    assert code == 0
    assert "41 values of voltages (frames 4, 5) are beyond 88 and were excluded" in err
    assert "1 values of time (frames 3) are beyond 1e+18 and were excluded" in err
    found = places(table)
    assert found[4] == found[3]  # through a frame that shows nothing a touch goes on, as live
    assert found[3] == places(whole)[3]
    assert math.dist(found[5], found[3]) < 0.005


def test_absurd_differences_are_excluded(save, image, frames) -> None:
    broken = frames - frames[:3].mean(axis=0)
    broken[1, 3] = 1e300
    code, _, err = image(save(voltages=None, dv=broken))
    assert code == 0
    assert "1 values of voltages (frames 1) are beyond 1e+12" in err


def test_a_frame_without_half_of_its_rows_shows_no_image_and_is_named(
    save, image, tmp_path, frames
) -> None:
    broken = frames.copy()
    broken[1, 5:26] = np.nan
    table = tmp_path / "touches.csv"
    code, out, err = image(save(voltages=broken), "--touches", table)
    assert code == 0
    assert "1 frames hold too many values that are not finite and show no image: 1\n" in err
    assert out.startswith("4 frames")
    assert "the file has no times of its frames, so each is searched by itself" in out
    assert 3 in places(table)


def test_a_longer_search_has_a_table_of_its_own(save, image, tmp_path) -> None:
    plain, beside, longer = (tmp_path / f"{name}.csv" for name in ("plain", "beside", "longer"))
    source = save(time_s=np.arange(4) / 10)
    assert image(source, "--reference", "first:3", "--touches", plain)[0] == 0
    code, out, _ = image(
        source, "--reference", "first:3", "--touches", beside, "--thorough", longer
    )
    assert code == 0
    assert plain.read_text() == beside.read_text()
    assert f"{longer}: each frame searched by itself, 1 touches in them all" in out
    assert math.dist(places(longer)[3], PLACE) < 0.015


def test_dynamic_imaging_holds_each_frame_against_the_one_before(
    save, image, tmp_path, frames
) -> None:
    shown, table = tmp_path / "maps.npz", tmp_path / "touches.csv"
    pressed_twice = np.vstack([frames, frames[3:] + 1e-7])
    source = save(voltages=pressed_twice)
    options = ("--reference", "previous", "--out", shown, "--touches", table)
    assert image(source, *options)[0] == 0
    found = np.load(shown)
    assert found["frames"].tolist() == [1, 2, 3, 4]
    depth = -found["images"].min(axis=1)
    assert depth[2] > 5 * depth[[0, 1, 3]].max()  # the press comes in frame 3, and stays
    assert math.dist(places(table)[3], PLACE) < 0.012
    code, _, err = image(source, "--reference", "previous", "--time-constant", "0.1 s")
    assert code == 1
    assert "cannot be filtered over frames as well" in err
    code, _, err = image(save(voltages=frames[:1]), "--reference", "previous")
    assert code == 1
    assert "expected at least two frames" in err


def test_a_time_constant_filters_the_images(save, image, tmp_path, frames) -> None:
    plain, slow = tmp_path / "plain.npz", tmp_path / "slow.npz"
    rest = frames[:3]
    source = save(voltages=np.vstack([rest, frames, rest]), time_s=np.arange(10) / 10)
    options = ("--alpha", "0.05", "--reference", "first:3")
    assert image(source, *options, "--out", plain)[0] == 0
    code, out, _ = image(source, *options, "--time-constant", "0.3 s", "--out", slow)
    assert code == 0
    assert "filtered over frames, time constant 0.3 s" in out
    before, after = (np.load(path)["images"].min(axis=1) for path in (plain, slow))
    assert after[6] > 0.95 * before[6]  # it comes later
    assert after[7] < 3 * before[7]  # and lasts
    off = tmp_path / "off.npz"
    assert image(source, *options, "--time-constant", "0 s", "--out", off)[0] == 0
    assert np.array_equal(np.load(off)["images"], np.load(plain)["images"])


def test_a_time_constant_needs_times_that_go_on(save, image) -> None:
    source = save(time_s=np.array([0.0, 0.1, 0.1, 0.2]))
    code, _, err = image(source, "--time-constant", "0.3 s")
    assert code == 0
    assert "1 times do not go on: frames 2; each is taken to be one interval after" in err
    code, _, err = image(save(time_s=None), "--time-constant", "0.3 s")
    assert code == 1
    assert "holds no times of its frames" in err
    assert image(source, "--time-constant", "0.3")[0] == 2
    assert image(source, "--time-constant", "-1 s")[0] == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--reference", "first:9"), "first:1 to first:4"),
        (("--limit", "0"), "expected a limit above 0"),
        (("--smooth", "90 mm", "--out", "maps.png"), "radius above 0 and up to 50 mm"),
        (("--reference", "frame:4"), "0 to 3"),
        (("--reference", "banana"), "expected first:N, frame:K, previous or a file"),
        (("--reference", ""), 'expected first:N, frame:K, previous or a file, got ""'),
        (("--frames", "3:9"), "within 0:4"),
        (("--skin", "textile-disc-16"), "rows are not in the recording"),
        (("--skin", "nothing"), "built-in skins"),
    ],
)
def test_what_cannot_be_is_one_sentence(save, image, arguments, said) -> None:
    code, _, err = image(save(), *arguments)
    assert code == 1
    assert said in err
    assert "Traceback" not in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda v: -v, "sign reversed"),
        (lambda v: v * (-1.0) ** np.arange(v.shape[1]), "does not fit this skin"),
        (lambda v: 1e3 * v, "times those of the skin's model"),
        (lambda v: np.full_like(v, np.nan), "no frame has finite values"),
        (lambda v: v[:0], "the recording is empty"),
    ],
)
def test_voltages_of_something_else(save, image, frames, change, said) -> None:
    code, _, err = image(save(voltages=change(frames)))
    assert code == 1
    assert said in err


def test_wrong_usage(save, image) -> None:
    assert image(save(), "--out", "maps.gif")[0] == 2
    assert image(save(), "--smooth", "8")[0] == 2
    assert image(save(), "--frames", "3")[0] == 2
    assert image()[0] == 2
