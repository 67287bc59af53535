"""Recordings of other programs: rows, signs and places, on real files where there are some."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.sparse import csc_matrix

from tomoskin.core import DataError
from tomoskin.files.imports import read_recording
from tomoskin.imaging import OneStep
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern
from tomoskin.model.skin import Skin

pytest.importorskip("tomoskin.extras.greit", reason="the tank is a skin of another extra")


def disc_of(n):
    """A round tank with ``n`` electrodes, the first at the top, clockwise."""
    changes = {"electrodes": {"count": n}, "mesh": {"cells": 2000}}
    return Skin.load("tank-16").altered(changes)


def model_for(recording, n, keep=slice(None)):
    skin = disc_of(n)
    pattern = Pattern.from_tables(recording.drive[keep], recording.measure[keep], n)
    return skin, ForwardModel(skin.mesh(), pattern, skin.contact_impedance, skin.current)


def cosine(a, b):
    return float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))


def free(recording):
    """Rows whose pair does not touch the drive."""
    touches = recording.drive[:, :, None] == recording.measure[:, None, :]
    return ~touches.any(axis=(1, 2))


# EIDORS.


@pytest.mark.data
def test_eidors_matrices_are_in_our_order_and_sign(data_dir):
    path = data_dir / "eidors_golden" / "a_disc8_netgen.mat"
    got = read_recording(path)
    golden = loadmat(path)
    pattern = Pattern.adjacent(8)
    assert np.array_equal(got.drive, pattern.drive)
    assert np.array_equal(got.measure, pattern.measure)
    assert np.array_equal(got.voltages, golden["vi"].T)
    assert np.array_equal(got.reference, golden["vh"].ravel())
    assert (got.in_order_of(pattern).reference > 0).all()


@pytest.mark.data
def test_eidors_structures_give_the_same(data_dir, tmp_path):
    """The golden matrices put into the structures that EIDORS itself saves, some sparse."""
    golden = loadmat(data_dir / "eidors_golden" / "a_disc8_netgen.mat")
    of_drive = golden["meas_stim"].ravel().astype(int)
    stimulation = [
        {
            "stimulation": "Amp",
            "stim_pattern": csc_matrix(golden["stim"][k - 1][:, None]),
            "meas_pattern": csc_matrix(golden["meas"][of_drive == k]),
        }
        for k in range(1, 9)
    ]
    full = np.zeros((64, 3))
    full[golden["meas_select"].ravel() != 0] = golden["vi"]
    cases = {
        "top": {"stimulation": stimulation, "vi": golden["vi"], "vh": golden["vh"]},
        "model": {"img": {"fwd_model": {"stimulation": stimulation}}, "vv": golden["vi"]},
        "full": {"stimulation": stimulation, "vi": full, "meas_select": golden["meas_select"]},
        "data": {"fmdl": {"stimulation": stimulation}, "vi": {"meas": golden["vi"]}},
        "in model": {
            "fmdl": {"stimulation": stimulation, "meas_select": golden["meas_select"]},
            "vi": full,
        },
        "deeper": {
            "imdl": {
                "fwd_model": {
                    "stimulation": stimulation,
                    "meas_select": csc_matrix(golden["meas_select"] != 0),
                }
            },
            "vi": {"meas": full},
            "meas_select": 1.0,
        },
    }
    for name, variables in cases.items():
        path = tmp_path / f"{name}.mat"
        savemat(path, variables, do_compression=name == "model")
        got = read_recording(path)
        assert np.array_equal(got.voltages, golden["vi"].T), name
        assert np.array_equal(got.drive, Pattern.adjacent(8).drive), name
        assert np.array_equal(got.measure, Pattern.adjacent(8).measure), name


def matlab(path, **variables):
    savemat(path, variables)
    return path


EYE = np.eye(8) - np.roll(np.eye(8), 1, axis=1)


@pytest.mark.parametrize(
    ("variables", "said"),
    [
        ({"stim": np.ones((8, 8)), "meas": EYE, "meas_stim": np.ones(8)}, "got a sum of 8"),
        ({"stim": EYE, "meas": EYE, "meas_stim": np.full(8, 9)}, "drives from 1 to 8"),
        ({"stim": EYE, "meas": EYE, "meas_stim": np.ones(8)}, "expected data of 8 rows"),
        ({"x": np.ones(3)}, "got the keys x"),
        ({"f": "text"}, r"got f \(text\)"),
        ({"r": {"name": "x", "value": 1.0}}, r"got r \(a structure of name, value\)"),
        ({}, "empty archive"),
    ],
)
def test_matlab_files_that_cannot_be_meant(tmp_path, variables, said):
    with pytest.raises(DataError, match=said):
        read_recording(matlab(tmp_path / "x.mat", **variables))


def test_thinned_data_of_a_full_scan(tmp_path):
    """As EIDORS has it with meas_current: all 64 rows in the model, 40 in the data."""
    rows = [(k, j) for k in range(8) for j in range(8)]
    select = np.array([{k, (k + 1) % 8}.isdisjoint({j, (j + 1) % 8}) for k, j in rows])
    stimulation = [{"stim_pattern": EYE[k][:, None], "meas_pattern": EYE} for k in range(8)]
    model = {"stimulation": stimulation, "meas_select": select[:, None]}
    data = np.arange(80.0).reshape(40, 2)
    got = read_recording(matlab(tmp_path / "x.mat", fmdl=model, vi=data))
    assert np.array_equal(got.voltages, data.T)
    assert free(got).all()
    whole = read_recording(matlab(tmp_path / "y.mat", fmdl=model, vi=np.ones((64, 2))))
    assert whole.voltages.shape == (2, 64)


def test_a_damaged_matlab_file_is_refused(tmp_path):
    path = tmp_path / "x.mat"
    savemat(path, {"stim": EYE, "vi": np.ones((8, 300))}, do_compression=True)
    data = path.read_bytes()
    for size in range(128, len(data), 97):
        path.write_bytes(data[:size])
        with pytest.raises(DataError, match=r"x\.mat"):
            read_recording(path)


@pytest.mark.parametrize("kind", [float, np.uint8])
def test_a_matlab_bomb_is_refused(tmp_path, monkeypatch, kind):
    """By what its numbers become in memory: MATLAB keeps small ones as bytes."""
    monkeypatch.setattr("tomoskin.core.user_files.machine_memory", lambda: 31_000_000)
    path = tmp_path / "bomb.mat"
    savemat(path, {"vi": np.zeros((1000, 1000), kind)}, do_compression=True)
    assert path.stat().st_size < 50_000
    with pytest.raises(DataError, match=r"more than a quarter of this machine's .* of memory"):
        read_recording(path)


def test_matlab_7_3_and_pickles_are_refused(tmp_path):
    newer, pickled = tmp_path / "new.mat", tmp_path / "x.pkl"
    newer.write_bytes(b"MATLAB 7.3 MAT-file".ljust(124) + b"\0\2IM" + bytes(400))
    with pytest.raises(DataError, match="-v7"):
        read_recording(newer)
    pickled.write_bytes(pickle.dumps({"v": [1.0]}))
    with pytest.raises(DataError, match="pickle"):
        read_recording(pickled)


@pytest.mark.parametrize("before", [b"", b"\x33\0\0\0\x90\x01\0\0\0\0\0\0"])
def test_a_file_of_draeger_is_named(tmp_path, before):
    path = tmp_path / "patient.eit"
    path.write_bytes(before + b"---Draeger EIT-Software---\r\nFramerate [Hz]: 50\r\n" + bytes(5000))
    with pytest.raises(DataError, match=r"patient\.eit: is a file of Dräger's.*eidors_readdata"):
        read_recording(path)


# The Kuopio challenge.


@pytest.mark.data
def test_the_challenges_water_is_that_of_a_round_tank(data_dir, tmp_path):
    got = read_recording(data_dir / "ktc2023_tank32" / "train.npz")
    assert got.voltages.shape == (4, 1922)  # six injections differ from others in sign alone
    kept = free(got)
    _, model = model_for(got, 32, kept)
    expected = model.solve(1.0).voltages
    assert cosine(got.reference[kept], expected) > 0.97
    with np.load(data_dir / "ktc2023_tank32" / "train.npz") as raw:
        path = matlab(tmp_path / "data1.mat", Inj=raw["inj"], Mpat=raw["mpat"].astype(float),
                      Uel=raw["U"][2], Uelref=raw["U_ref"])  # fmt: skip
    own = read_recording(path)
    assert np.array_equal(own.voltages[0], got.voltages[2])
    assert np.array_equal(own.drive, got.drive)
    assert np.array_equal(own.measure, got.measure)
    assert np.array_equal(own.reference, got.reference)


@pytest.mark.data
def test_the_challenges_bodies_are_where_they_lay(data_dir):
    """The strongest change of a plain one-step picture lies within a body, in each sample."""
    path = data_dir / "ktc2023_tank32" / "train.npz"
    got = read_recording(path)
    with np.load(path) as raw:
        truth = raw["truth"]
    kept = free(got)
    skin, model = model_for(got, 32, kept)
    operator = OneStep(model, "noser", alpha=0.3, conductivity=1.0)
    expected = model.solve(1.0).voltages
    scale = got.reference[kept] @ expected / (expected @ expected)
    centres, radius = skin.mesh().centroids, skin.outline.length / (2 * np.pi)
    for frame, labels in zip(got.voltages, truth, strict=True):
        image = operator((frame - got.reference)[kept] / scale).values
        x, y = centres[np.argmax(np.abs(image))] / radius
        row, column = round(127.5 * (1 - y)), round(127.5 * (1 + x))
        near = labels[max(row - 16, 0) : row + 17, max(column - 16, 0) : column + 17]
        assert (near > 0).any()
        strongest = image[np.argmax(np.abs(image))]
        assert (near == (1 if strongest < 0 else 2)).any()


# Soft skins.


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "shape", "is_change", "labels"),
    [
        ("eskin_varsens16/noPattern", (2025, 192), True, 2025),
        ("eskin_hydrogel_round/round16_single550", (446, 192), True, 446),
        ("eskin_hydrogel_round/round16_damage_series", (650, 192), False, 0),
        ("eskin_hydrogel_rect8/rect8_single10k", (8100, 32), True, 8100),
        ("eskin_hydrogel_rect8/rect16_repeat50x5", (205, 192), False, 205),
        ("eskin_gelatin_rect32/one_ND", (628, 1024), True, 628),
        ("eskin_gelatin_rect32/two_ND", (405, 1024), True, 0),
        ("eskin_gelatin_rect32/baseline_ND", (329, 1024), False, 0),
    ],
)
def test_soft_skins_are_read(data_dir, name, shape, is_change, labels):
    path = data_dir / f"{name}.npz"
    got = read_recording(path)
    assert got.voltages.shape == shape
    assert got.is_change is is_change
    assert (0 if got.labels is None else len(got.labels)) == labels
    with np.load(path) as raw:
        assert np.array_equal(got.drive, raw["inj"][:, ::-1])  # drives from both ends too
        assert np.array_equal(got.measure, raw["meas"])
        assert got.notes == ()
        if "v_up" in raw:
            expected = raw["v_down"].astype(float) - raw["v_up"].astype(float)
            assert np.array_equal(got.voltages, expected)
        if labels:
            place = raw["xy_mm"].reshape(-1, 2)
            assert np.allclose(got.labels[:: labels // len(place)], 1e-3 * place)


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "n"),
    [("eskin_hydrogel_round/round16_damage_series", 16), ("eskin_gelatin_rect32/baseline_ND", 32)],
)
def test_untouched_soft_skins_have_the_signs_of_a_uniform_disc(data_dir, name, n):
    got = read_recording(data_dir / f"{name}.npz")
    kept = free(got)
    _, model = model_for(got, n, kept)
    middle = np.median(got.voltages, axis=0)[kept]
    assert np.corrcoef(middle, model.solve(1.0).voltages)[0, 1] > 0.5


@pytest.mark.data
def test_sets_without_signs_are_refused_with_their_keys(data_dir):
    with pytest.raises(DataError, match="rms_after"):
        read_recording(data_dir / "eskin_membrane8_sixpoint" / "batch1.npz")


# A dirty serial log.


def whole_frames(text):
    """Counted here another way: every mark followed by 16 full lines with a rising clock."""
    lines = [line.rstrip(",").split(",") for line in text.splitlines()]
    count = 0
    for number, line in enumerate(lines):
        following = lines[number + 1 : number + 17]
        if line[2:] != ["A"] or len(following) < 16:
            continue
        try:
            clock = [int(row[2]) for row in following]
            good = all(len([int(x) for x in row[3:]]) == 16 for row in following)
        except (ValueError, IndexError):
            continue
        count += good and all(0 < b - a < 1000 for a, b in itertools.pairwise(clock))
    return count


@pytest.mark.data
@pytest.mark.parametrize("name", ["expABCX_150mm_8p5wt_6", "expABX_100mm_9p5wt_6"])
def test_of_a_dirty_log_whole_frames_are_kept_and_the_rest_is_listed(data_dir, tmp_path, name):
    path = data_dir / "ert_cbsr16_dirty_stream" / f"{name}.npz"
    with np.load(path) as archive:
        raw = archive["raw"].tobytes()
    got = read_recording(path)
    text = raw.decode(errors="replace")
    assert len(got) == whole_frames(text) > 100
    lines = sum(1 for line in text.splitlines() if line.strip())
    counted = sum(int(note.split()[0]) for note in got.notes)
    marks = sum(line.rstrip(",").endswith(",A") for line in text.splitlines())
    assert 16 * len(got) + counted + marks == lines
    assert any("incomplete frames: " in note for note in got.notes)
    assert (np.diff(got.time) > 0).all()
    (tmp_path / "log.csv").write_bytes(raw)
    same = read_recording(tmp_path / "log.csv")
    assert np.array_equal(same.voltages, got.voltages)
    assert same.notes == got.notes


def reciprocity(table):
    both = np.isfinite(table) & np.isfinite(table.T)
    return float(np.corrcoef(table[both], table.T[both])[0, 1])


@pytest.mark.data
@pytest.mark.parametrize("name", ["expABCX_150mm_8p5wt_6", "expABX_100mm_9p5wt_6"])
def test_the_dirty_logs_rows_are_reciprocal_and_fall_with_distance(data_dir, name):
    got = read_recording(data_dir / "ert_cbsr16_dirty_stream" / f"{name}.npz")
    mean = np.median(got.voltages, axis=0)
    table = np.full((16, 16), np.nan)
    table[got.drive[:, 1], got.measure[:, 0]] = mean - mean.min()
    known = np.isfinite(table)
    assert np.array_equal(known, known.T)
    assert reciprocity(table) > 0.5
    if name.startswith("expABX"):  # the other log's values lag behind the switching
        turned = [reciprocity(np.roll(table, shift, axis=1)) for shift in (-2, -1, 1, 2)]
        assert max(turned) < reciprocity(table)  # no other layout is as reciprocal
    distance = np.abs(np.arange(16)[:, None] - np.arange(16))
    distance = np.minimum(distance, 16 - distance)
    near, far = table[distance == 2], table[distance >= 5]
    assert np.nanmedian(near) > np.nanmedian(far)
    measured = got.in_order_of(Pattern.adjacent(16))
    assert measured.voltages.shape == (len(got), 208)


# Text logs of other boards.


def uniform(n, drive, measure):
    """Voltages of a uniform disc on rows of ``n`` electrodes."""
    skin = disc_of(n)
    pattern = Pattern.from_tables(drive, measure, n)
    model = ForwardModel(skin.mesh(), pattern, skin.contact_impedance, skin.current)
    return model.solve(1.0).voltages


def open_eit_line(values):
    return "magnitudes : " + "".join(f"{value:12.4f} , " for value in values) + "\r\n"


@pytest.mark.parametrize(
    ("count", "n", "spread"), [(32, 8, 3), (40, 8, 1), (192, 16, 8), (208, 16, 1)]
)
def test_open_eit_logs(tmp_path, count, n, spread):
    """Rows in pyEIT's order: drive k, k + spread; pairs from electrode 0 on; sizes only."""
    path = tmp_path / "data.txt"
    frames = np.arange(3 * count, dtype=float).reshape(3, count) + 1000
    text = "\nhello, board\n" + "".join(map(open_eit_line, frames)) + open_eit_line(frames[0][:-1])
    path.write_text(text)
    got = read_recording(path)
    half = got.voltages.shape[1]
    expected = frames if half == count else (frames[:, :half] + frames[:, half:]) / 2
    assert np.array_equal(got.voltages, expected)
    rows = [
        ((k, (k + spread) % n), {j, (j + 1) % n})
        for k in range(n // 2 if 2 * spread == n else n)
        for j in range(n)
        if not {k, (k + spread) % n} & {j, (j + 1) % n}
    ]
    assert [(tuple(d), set(m)) for d, m in zip(got.drive, got.measure, strict=True)] == rows
    assert (uniform(n, got.drive, got.measure) > 0).all()
    assert sum(note.startswith("1 line ") for note in got.notes) == 2
    assert any("96 of 192 rows repeat" in note for note in got.notes) == (count == 192)


def test_open_eit_by_two_terminals(tmp_path):
    path = tmp_path / "background.txt"
    path.write_text(open_eit_line(range(28)))
    got = read_recording(path)
    assert np.array_equal(got.drive[[0, 6, 7, 27]], [[0, 1], [0, 7], [1, 2], [6, 7]])
    assert np.array_equal(got.drive, got.measure)


def test_a_decimal_comma_is_refused_with_its_line(tmp_path):
    path = tmp_path / "komma.txt"
    path.write_text(open_eit_line(np.arange(40) + 0.5).replace(".", ","))
    with pytest.raises(DataError, match=r"got 80 in line 1.*decimal point"):
        read_recording(path)
    table = tmp_path / "komma.csv"
    table.write_text("time_s;v_1_0_2_3\n0,5;1,5\n")
    with pytest.raises(DataError, match=r"line 1.*1\.5, not 1,5"):
        read_recording(table)
    table.write_text("time_s,v_1_0_2_3\n0,5,1,5\n")
    with pytest.raises(DataError, match=r"line 2: expected 2 fields, got 4.*decimal comma"):
        read_recording(table)


def eit_kit_text(beginning, frame):
    return beginning + "\r\n" + "".join(f"{value:.4f}\r\n" for value in frame)


@pytest.mark.parametrize("n", [8, 16, 32])
def test_eit_kit_logs(tmp_path, n):
    rng = np.random.default_rng(n)
    frames = (rng.random((3, n * n)) + 1).round(4)
    text = "starting with \r\n" + eit_kit_text("origin frame", frames[0])
    text += eit_kit_text("framei", frames[1]) + eit_kit_text("framei", frames[1][:-9])
    text += eit_kit_text("framei", frames[2])
    path = tmp_path / "log.txt"
    path.write_text(text)
    got = read_recording(path)
    pattern = Pattern.adjacent(n)
    assert np.array_equal(got.drive, pattern.drive)
    assert np.array_equal(got.measure, pattern.measure)
    place = n * pattern.drive[:, 1] + pattern.measure[:, 0]
    assert np.array_equal(got.voltages, frames[1:, place])
    assert np.array_equal(got.reference, frames[0, place])
    assert any(
        note.startswith(f"{n * n - 9 + 1} lines left out, parts of incomplete")
        for note in got.notes
    )


# pyEIT.


def test_pyeit_arrays(tmp_path):
    """Current in at ex_mat's first; voltage of meas_mat's first less that of its second."""
    n = 8
    ex_mat = np.array([[k, (k + 1) % n] for k in range(n)])
    meas_mat = np.array(
        [
            [((j + 1) % n, j) for j in range(n) if not {j, (j + 1) % n} & set(pair)]
            for pair in ex_mat.tolist()
        ]
    )
    drive = np.repeat(ex_mat, n - 3, axis=0)
    voltages = uniform(n, drive, meas_mat.reshape(-1, 2))
    path = tmp_path / "x.npz"
    np.savez(path, ex_mat=ex_mat, meas_mat=meas_mat, v=np.stack([voltages, 2 * voltages]))
    got = read_recording(path).in_order_of(Pattern.adjacent(n))
    own = Pattern.adjacent(n)
    assert np.allclose(got.voltages[0], uniform(n, own.drive, own.measure), rtol=1e-9)
    np.savez(path, ex_mat=ex_mat, v1=voltages, v0=voltages)
    standard = read_recording(path).in_order_of(own)
    assert np.allclose(standard.voltages, got.voltages[:1])
    assert np.allclose(standard.reference, got.voltages[0])


@pytest.mark.parametrize(
    "arrays",
    [
        {"ex_mat": np.zeros((3, 3)), "v": np.ones(4)},
        {"ex_mat": [[0, 1]], "v": np.ones(4)},
        {"ex_mat": [[0, 1]], "meas_mat": np.zeros((2, 3, 2)), "v": np.ones(4)},
        {"inj": [[0, 1]], "meas": [[2, 3]], "dv": np.ones((4, 2))},
        {"inj": [[0, 1]], "meas": [[2, 3]], "dv": np.ones((4, 1)), "xy_mm": np.ones((3, 2))},
        {"inj": [[0, 1]], "meas": [[2, 3]], "v_up": np.ones((4, 1)), "v_down": np.ones((3, 1))},
        {"inj": np.eye(4), "mpat": np.eye(4), "U": np.ones(16)},
        {"raw": np.frombuffer(b"time_pc\n1,2,3", np.uint8)},
    ],
)
def test_arrays_that_do_not_belong_together(tmp_path, arrays):
    np.savez(tmp_path / "x.npz", **arrays)
    with pytest.raises(DataError, match=r"x\.npz"):
        read_recording(tmp_path / "x.npz")
