"""``tomoskin record`` and ``tomoskin session``: from a twin to a file, and what it says of it."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys

import pytest

from files.session.runs import write_all, write_frames
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader
from tomoskin.model.skin import Skin


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short recording of a twin that does not wait."""
    from tomoskin.cli import main

    path = tmp_path_factory.mktemp("run") / "run.mcap"
    with pytest.raises(SystemExit) as end:
        main(["record", str(path), "--source", "twin:fast", "--frames", "60"])
    assert not end.value.code
    return path


def test_record_writes_what_was_asked_for(recorded):
    with SessionReader(recorded) as session:
        frames = [item.frame for item in session.frames()]
        assert session.device()["firmware"]
        assert session.settings()["source"] == "twin of textile-disc-8"
        assert session.epoch > 1e9
    assert len(frames) == 60
    assert [frame.sequence for frame in frames] == list(range(len(frames)))


def test_info(tomoskin, recorded):
    code, out, errors = tomoskin("session", "info", recorded)
    assert (code, errors) == (0, "")
    assert "textile-disc-8: 8 electrodes, 40 measurements" in out
    code, out, _ = tomoskin("session", "info", recorded, "--json")
    found = json.loads(out)
    assert found["frames"] >= 60
    assert found["lost"] == found["gaps"] == 0
    assert found["torn"] == ""
    assert found["events"]["connected"] == 1
    assert "none recorded" not in out


def test_info_counts_touches_as_image_does(tomoskin, tmp_path):
    """Each once, and says where none recorded."""
    _, out, _ = tomoskin("session", "info", write_all(tmp_path / "all.mcap"))
    assert re.search(r"touches +1\n +touch   4    0.20 to   0.20 s  x  \+100.0 mm", out)
    assert re.search(r"presses +1 on the twin", out)
    _, out, _ = tomoskin("session", "info", write_frames(tmp_path / "few.mcap", 3))
    assert "none recorded: tomoskin image finds them" in out


def test_repair_mends_a_cut_file_and_leaves_it_alone(tomoskin, recorded, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recorded.read_bytes()[:-5000])
    before = cut.read_bytes()
    code, _, errors = tomoskin("session", "info", cut)
    assert code == 0
    assert "is incomplete" in errors
    code, _, errors = tomoskin("image", cut, "--frames", "0:2")
    assert code == 0
    assert "tomoskin session repair completes it" in errors
    code, out, _ = tomoskin("session", "repair", cut)
    assert code == 0
    assert "recovered" in out
    assert cut.read_bytes() == before
    code, _, errors = tomoskin("session", "info", tmp_path / "cut.repaired.mcap")
    assert (code, errors) == (0, "")
    code, _, errors = tomoskin("session", "repair", cut)
    assert code == 2
    assert "exists already" in errors


def test_a_session_is_imaged_with_its_own_skin(tomoskin, tmp_path):
    path = tmp_path / "sixteen.mcap"
    tomoskin("record", path, "--skin", "textile-disc-16", "--source", "twin:fast", "--frames", 5)
    code, out, _ = tomoskin("image", path, "--frames", "0:2", "--json")
    assert code == 0
    assert json.loads(out)["frames"] == 2


def test_a_session_without_a_whole_reference_is_said(tomoskin, tmp_path):
    code, _, errors = tomoskin("image", write_frames(tmp_path / "few.mcap", 3))
    assert code == 1
    assert "holds too few frames for a reference: 3 of 20" in errors
    assert "choose untouched frames with --reference" in errors


def test_a_session_imaged_with_another_skin_is_said(tomoskin, recorded, tmp_path):
    """The pattern of all discs is the same: only the size, and the file itself, tell."""
    other = Skin.load("textile-disc-8").altered(
        {
            "skin": {"name": "other"},
            "outline": {"diameter": "300 mm"},
            "material": {"sheet_resistance": "8 ohm/sq"},
            "electrodes": {"contact_impedance": "2 mohm*m"},
        }
    )
    file = tmp_path / "other.toml"
    file.write_text(other.to_toml())
    code, out, errors = tomoskin("image", recorded, "--frames", "0:22", "--skin", file)
    assert code == 0
    assert "model by 1.000" in out
    assert "was recorded on textile-disc-8, but other has another" in errors
    assert "times its size: check the skin, its current and its sheet resistance" in errors
    code, out, errors = tomoskin("image", recorded, "--frames", "0:22", "--skin", "textile-disc-8")
    assert (code, errors) == (0, "")
    assert "model by 1.000" in out


def test_a_replay_is_recorded_with_the_skin_in_the_file(tomoskin, recorded, tmp_path):
    again = tmp_path / "again.mcap"
    code, _, errors = tomoskin(
        "record", again, "--source", f"replay:{recorded}@max", "--frames", "60"
    )
    assert (code, errors) == (0, "")
    with SessionReader(again) as one, SessionReader(recorded) as other:
        pairs = zip(one.frames(), other.frames(), strict=False)
        assert all(a.frame.host_time == b.frame.host_time for a, b in pairs)


def test_a_source_that_cannot_be_opened_leaves_no_file(tomoskin, tmp_path):
    code, _, errors = tomoskin("record", tmp_path / "x.mcap", "--source", "serial:nowhere")
    assert code == 1
    assert "no such port" in errors
    assert not (tmp_path / "x.mcap").exists()


def test_an_existing_file_is_refused(tomoskin, recorded):
    code, _, errors = tomoskin("record", recorded, "--source", "twin:fast", "--frames", "1")
    assert code == 2
    assert "exists already" in errors


@pytest.mark.parametrize(
    "command",
    [
        ("image",),
        ("session", "info"),
        ("session", "repair"),
        ("skin", "check"),
        ("locate", "presses.npz", "--calibration"),
    ],
)
def test_an_empty_file_is_called_so(tomoskin, tmp_path, command):
    path = tmp_path / "x.mcap"
    path.touch()
    code, _, errors = tomoskin(*command, path)
    assert code == 1
    assert errors == f"tomoskin: {path}: is an empty file\n"


@pytest.mark.parametrize("seconds", ["0", "-1", "nan"])
def test_no_time_is_no_recording(tomoskin, tmp_path, seconds):
    code, _, errors = tomoskin("record", tmp_path / "x.mcap", "--seconds", seconds)
    assert code == 2
    assert "expected more than 0 s" in errors
    assert not (tmp_path / "x.mcap").exists()


@pytest.mark.parametrize("command", ["info", "repair"])
def test_what_is_no_session_is_one_sentence(tomoskin, tmp_path, command):
    path = tmp_path / "x.mcap"
    path.write_text("not at all")
    code, _, errors = tomoskin("session", command, path)
    assert code == 1
    assert errors.startswith(f"tomoskin: {path}")
    assert len(errors.splitlines()) == 1
    code, _, errors = tomoskin("session", command, tmp_path / "none.mcap")
    assert code == 1
    assert len(errors.splitlines()) == 1


def test_a_session_is_imaged_against_the_frames_that_the_run_took(tomoskin, recorded):
    """So the noise is known, and an idle skin has no touches."""
    assert read_recording(recorded).idle == 20
    code, out, _ = tomoskin("image", recorded, "--json")
    assert code == 0
    found = json.loads(out)
    assert len(found["touches"]) <= found["frames"] // 20


@pytest.mark.data
def test_import_keeps_what_is_whole_and_lists_the_rest(tomoskin, data_dir, tmp_path):
    log = data_dir / "ert_cbsr16_dirty_stream" / "expABX_100mm_9p5wt_6.npz"
    code, out, errors = tomoskin("session", "import", log, tmp_path / "log.npz")
    assert code == 0
    assert "145 frames of 208 rows" in out
    assert "lines left out, parts of incomplete frames" in errors
    assert len(read_recording(tmp_path / "log.npz")) == 145
    assert tomoskin("session", "import", log, tmp_path / "log.doc")[0] == 2


def test_recording_a_replay_ends_with_it(tomoskin, recorded, tmp_path):
    copy = tmp_path / "copy.mcap"
    code, out, err = tomoskin("record", copy, "--source", f"replay:{recorded}@max", "--json")
    assert code == 0, err
    code, told, _ = tomoskin("session", "info", recorded, "--json")
    assert json.loads(out)["frames"] == json.loads(told)["frames"]
    assert "Ctrl-C" not in err


def test_a_session_without_its_end_is_recorded_again(tomoskin, recorded, tmp_path):
    whole, cut, again = (tmp_path / f"{name}.mcap" for name in ("whole", "cut", "again"))
    assert tomoskin("record", whole, "--source", f"replay:{recorded}@max", "--json")[0] == 0
    cut.write_bytes(whole.read_bytes()[:-5000])  # it is not known how long it is
    code, out, err = tomoskin("record", again, "--source", f"replay:{cut}@max", "--json")
    assert code == 0, err
    with SessionReader(cut) as session:
        assert json.loads(out)["frames"] == sum(1 for _ in session.frames())


def test_what_is_written_is_said(tomoskin, recorded, tmp_path):
    table = tmp_path / "x.csv"
    code, out, _ = tomoskin("session", "export", recorded, table)
    assert code == 0
    assert out.startswith(f"{table}: ")
    code, _, err = tomoskin("session", "info", table)
    assert (code, "session import" in err) == (1, True)
    code, _, err = tomoskin("session", "export", recorded, tmp_path / "none" / "x.csv")
    assert (code, "create the folder first" in err) == (2, True)


def test_a_file_whose_name_is_no_text_is_told(recorded, tmp_path, monkeypatch):
    from tomoskin.cli import main

    path = tmp_path / "run\udcff.mcap"
    try:
        shutil.copy(recorded, path)
    except OSError as error:
        pytest.skip(f"names are text here: {error}")
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, "utf-8", errors="strict"))
    with pytest.raises(SystemExit) as end:
        main(["session", "info", str(path)])
    sys.stdout.flush()
    assert not end.value.code
    assert b"run\\udcff.mcap" in written.getvalue()
