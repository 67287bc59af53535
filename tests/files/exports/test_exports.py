"""Exports: what other programs read is what was recorded."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree as Xml

import h5py
import numpy as np
import pyarrow.parquet as pq
import pytest
from PIL import Image
from scipy.io import loadmat

from files.session.runs import SKIN, TOUCH, frame_of, put, write_all, write_frames
from tomoskin.core import Amount, DataError
from tomoskin.files.exports import FILMS
from tomoskin.files.exports.session_export import fields_of
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader, SessionWriter
from tomoskin.files.session.scanned import MOST_FRAMES

PATTERN = SKIN.pattern()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A session with something in every channel, and a reference of five frames."""
    path = tmp_path_factory.mktemp("whole") / "whole.mcap"
    return write_all(path, reference=(0, 5))


@pytest.fixture(scope="module")
def recording(whole):
    return read_recording(whole)


@pytest.fixture
def export(tomoskin, whole, tmp_path):
    """Export to a name: the file."""

    def export(name, *options):
        code, out, errors = tomoskin("session", "export", whole, tmp_path / name, *options)
        assert (code, errors) == (0, "")
        assert str((tmp_path / name).with_suffix("")) in out
        return tmp_path / name

    return export


def same(a, b):
    return np.array_equal(a, b, equal_nan=True)


@pytest.mark.parametrize("name", ["x.csv", "x.npz"])
def test_it_is_read_again_as_the_session_is(export, recording, name):
    """With all that an image rests on: so it gives the same touches, at the same times."""
    got = read_recording(export(name))
    for array in ("voltages", "drive", "measure", "time", "labels"):
        assert same(getattr(got, array), getattr(recording, array)), array
    assert (got.idle, got.reference) == (recording.idle, None)
    assert recording.idle == 5


def test_a_file_that_was_not_written_is_not_named(tomoskin, whole, tmp_path):
    (tmp_path / "x.pvd").write_text("of another export", encoding="utf-8")
    _, out, _ = tomoskin("session", "export", whole, tmp_path / "x.csv")
    assert "x.pvd" not in out


def test_what_a_table_cannot_hold_is_said(tomoskin, whole, tmp_path):
    for ending, said in ((".csv", True), (".npz", True), (".mat", True), (".h5", False)):
        _, out, _ = tomoskin("session", "export", whole, tmp_path / f"x{ending}")
        without = "without the skin (--skin textile-disc-8), the touches (--touches X.csv), events"
        assert (without in out) == said, ending
        assert ("calibration.json" in out) == said, ending


@pytest.mark.parametrize(
    ("column", "said"), [("0,1", "idle 1 in the first frames"), ("1,nan", "idle 1 in the first")]
)
def test_idle_frames_that_are_not_the_first_are_refused(tmp_path, column, said):
    path = tmp_path / "x.csv"
    lines = [f"{idle},0.1" for idle in column.split(",")]
    path.write_text("\n".join(["idle,v_1_0_2_3", *lines]))
    with pytest.raises(DataError, match=said):
        read_recording(path)


def test_parquet(export, recording):
    table = pq.read_table(export("x.parquet"))
    beside = ["frame", "time_s", "sequence", "ticks", "mark", "idle", "x_m", "y_m"]
    assert table.column_names == [*beside, "voltages"]
    values = table["voltages"].combine_chunks().flatten().to_numpy(zero_copy_only=False)
    assert same(values.reshape(-1, PATTERN.n_meas), recording.voltages)
    assert table["time_s"].to_pylist() == recording.time.tolist()
    assert table["idle"].to_pylist() == 5 * [1] + 25 * [0]
    assert table["ticks"].to_pylist() == [frame_of(n).ticks for n in range(30)]
    assert json.loads(table.schema.metadata[b"drive"]) == PATTERN.drive.tolist()
    assert json.loads(table.schema.metadata[b"measure"]) == PATTERN.measure.tolist()


def test_parquet_of_more_than_a_block(tomoskin, tmp_path):
    count = MOST_FRAMES + 7
    with SessionWriter(tmp_path / "long.mcap", SKIN) as session:
        for number in range(count):
            put(session, frame_of(number))
    code, _, _ = tomoskin("session", "export", tmp_path / "long.mcap", tmp_path / "x.parquet")
    assert code == 0
    table = pq.read_table(tmp_path / "x.parquet")
    assert table["sequence"].to_pylist() == list(range(count))


def test_hdf5_holds_everything(export, recording, whole):
    with h5py.File(export("x.h5")) as file, SessionReader(whole) as session:
        assert same(file["frames/voltages"][:], recording.voltages)
        assert same(file["frames/samples"][3], frame_of(3).samples)
        assert same(file["drive"][:], PATTERN.drive)
        [touch] = file["touches"][:]
        [expected] = next(iter(session.touches())).touches
        assert (touch["id"], touch["x"]) == (expected.id, expected.detection.x)
        assert (touch["frame"], touch["time"]) == (20, recording.time[20])
        assert json.loads(file["truth"][1])["presses"][0]["shape"] == "round"
        assert json.loads(file.attrs["device"])["firmware"] == "1.2.3"
        assert file.attrs["skin"] == SKIN.to_toml()


def test_matlab_has_eidors_structures(export, recording):
    variables = loadmat(export("x.mat"))
    assert variables["stimulation"].shape == (1, PATTERN.n_drive)
    first = variables["stimulation"][0, 0]  # a structure array, not cells
    assert first["stimulation"].item() == "Amp"
    currents = np.asarray(first["stim_pattern"].todense()).ravel()
    source, sink = PATTERN.drives[0]
    assert (currents[source], currents[sink]) == (SKIN.current, -SKIN.current)
    assert np.count_nonzero(currents) == 2
    measured = np.asarray(first["meas_pattern"].todense())
    assert measured.shape == (5, 8)
    assert np.array_equal(measured.argmax(axis=1), PATTERN.measure[:5, 0])
    assert np.array_equal(measured.argmin(axis=1), PATTERN.measure[:5, 1])
    assert same(variables["vi"], recording.voltages.T)


def test_a_series_of_meshes(export):
    path = export("x.vtu", "--every", "0.05")
    listed = Xml.parse(path.with_suffix(".pvd")).getroot().findall(".//DataSet")
    times = [float(item.get("timestep")) for item in listed]
    files = [path.with_name(item.get("file")) for item in listed]
    assert len(files) == 6  # of 25 frames in 0.25 s, after a reference of 1
    assert times == sorted(times)
    for file in files:
        piece = Xml.parse(file).getroot().find(".//Piece")
        assert int(piece.get("NumberOfCells")) == len(SKIN.mesh().cells)
        names = [array.get("Name") for array in piece.findall("CellData/DataArray")]
        assert names == ["change"]  # no depth is calibrated, so there is no dent


def test_a_series_holds_the_dent_of_touches_with_depths():
    """And nothing where one has none."""
    skin = SKIN.altered({"surface": {"layer": "3 mm"}})
    mesh = skin.mesh()
    deep = replace(TOUCH.detection, x=0.02, y=0.0, depth=Amount(1e-3, 0.8e-3, 1.2e-3))
    result = SimpleNamespace(image=SimpleNamespace(values=np.zeros(len(mesh.cells))))

    def names(detection, skin, calibrations):
        result.touches = (replace(TOUCH, detection=detection),)
        job = SimpleNamespace(
            session=SimpleNamespace(skin=skin),
            prepared=SimpleNamespace(mesh=mesh, calibrations=calibrations),
        )
        return fields_of(job, result)

    fields = names(deep, skin, {"depth": None})
    assert list(fields) == ["change", "deflection_m", "deflection_sd_m"]
    lowest = mesh.centroids[fields["deflection_m"].argmax()]
    assert np.hypot(*(lowest - (0.02, 0.0))) < 0.01
    assert fields["deflection_m"].max() == pytest.approx(1e-3, rel=0.02)
    for case in (
        (TOUCH.detection, skin, {"depth": None}),
        (deep, SKIN, {"depth": None}),
        (deep, skin, {}),
    ):
        assert list(names(*case)) == ["change"]


def test_pictures_of_the_map(export):
    with Image.open(export("x.png")) as picture:
        assert picture.width > 300
    with Image.open(export("x.gif", "--every", "0.04")) as film:
        assert film.n_frames > 1


def test_a_film_without_ffmpeg_is_one_clear_sentence(tomoskin, whole, tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda _: None)
    code, _, errors = tomoskin("session", "export", whole, tmp_path / "x.mp4")
    assert code == 1
    assert "ffmpeg, which is not installed" in errors
    assert not (tmp_path / "x.mp4").exists()


def test_a_film_goes_through_ffmpeg(tmp_path, monkeypatch):
    """A program of that name that keeps what it is given."""
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\ncat > "$last"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    pictures = [np.full((4, 6, 3), n, np.uint8) for n in range(3)]
    FILMS[".mp4"](tmp_path / "x.mp4", pictures, 10.0)
    assert (tmp_path / "x.mp4").read_bytes() == b"".join(p.tobytes() for p in pictures)
    program.write_text("#!/bin/sh\necho no such codec >&2\nexit 3\n")
    with pytest.raises(DataError, match="no such codec"):
        FILMS[".mp4"](tmp_path / "y.mp4", pictures, 10.0)


def test_touches_beside(export, tmp_path):
    export("x.npz", "--touches", tmp_path / "t.csv")
    with (tmp_path / "t.csv").open() as file:
        [row] = csv.DictReader(file)
    assert (row["frame"], row["id"], row["sd_y_m"]) == ("20", "4", "")


def test_touches_of_a_session_without_a_whole_reference_are_refused(tomoskin, tmp_path):
    """A table with a header alone would say that nothing was touched."""
    few = write_frames(tmp_path / "few.mcap", 3)
    touches = tmp_path / "t.csv"
    code, _, errors = tomoskin("session", "export", few, tmp_path / "x.csv", "--touches", touches)
    assert code == 1
    assert "few.mcap: holds too few frames for a reference, so there are no images and no" in errors
    assert not touches.exists()


@pytest.mark.parametrize("name", ["x.csv", "x.parquet", "x.h5", "x.mat", "x.png", "x.npz"])
def test_a_session_without_frames_gives_no_file_of_nothing(tomoskin, tmp_path, name):
    with SessionWriter(tmp_path / "empty.mcap", SKIN) as session:
        session.note(0.0, "nothing")
    code, _, errors = tomoskin("session", "export", tmp_path / "empty.mcap", tmp_path / name)
    assert code == 1
    assert "holds no frame" in errors or "too few frames" in errors


@pytest.mark.parametrize("name", ["x.csv", "x.parquet", "x.h5", "x.mat", "x.vtu", "x.gif"])
def test_a_place_that_cannot_be_written(tomoskin, whole, tmp_path, name):
    code, _, errors = tomoskin("session", "export", whole, tmp_path / "none" / name)
    assert code == 2
    assert len(errors.splitlines()) == 1
    assert "none" in errors


def test_an_unknown_ending_is_wrong_usage(tomoskin, whole, tmp_path):
    code, _, errors = tomoskin("session", "export", whole, tmp_path / "x.doc")
    assert code == 2
    assert ".parquet" in errors


def test_exports_say_that_the_file_is_torn(tomoskin, whole, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[:-3000])
    code, _, errors = tomoskin("session", "export", cut, tmp_path / "x.npz")
    assert code == 0
    assert "is incomplete" in errors
