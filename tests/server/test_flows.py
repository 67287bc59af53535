"""Files, replays, sources and guided presses, as a page asks for them."""

from __future__ import annotations

import csv
import os
from pathlib import Path

import numpy as np
import pytest

from run.test_runner import Watch
from server.flowing import flowing
from tomoskin.board.source import open_source
from tomoskin.core import DataError
from tomoskin.files.session import SessionReader, as_recorded, first_scan, replayed
from tomoskin.files.session.session_reader import end_time, start_time
from tomoskin.learning import TOUCH, ChannelMapping, Locator
from tomoskin.model.skin import Skin
from tomoskin.run import commands
from tomoskin.server.folder import Folder
from tomoskin.server.source_handlers import SourceSwitch
from tomoskin.twin import Press

FORCE, RADIUS = 9.0, 0.015
NAMES = [
    "../secret.npz",
    "..",
    "/etc/passwd",
    "a/b.npz",
    "a\\b.npz",
    ".hidden.npz",
    "run.mcap\n",
    "run.txt",
    "-run.npz",
    "a\0.npz",
    "x" * 200 + ".npz",
    "",
]


@pytest.fixture
def flows(prepared, tmp_path):
    (tmp_path / "sessions").mkdir()
    with flowing(prepared, tmp_path / "sessions") as found:
        yield found


def quick(skin):
    """Opens a twin that does not wait between frames, the same in each run."""
    return lambda: open_source("twin:fast,preset=ideal,seed=1", skin)


def press_dots(site, page, count):
    """Press where the dot is, ``count`` times; the last flow message."""
    for done in range(count):
        press_dot(site, page, done)
    return page.told("flow", lambda m: len(m["presses"]) == count and not m["thinking"])


def press_dot(site, page, done):
    told = page.told("flow", lambda m: m.get("phase") == "press" and len(m["presses"]) == done)
    force = FORCE * {"softly": 0.5, "hard": 2.0, None: 1.0}[told["effort"]]
    site.runner.ask(commands.HoldPresses(page, (Press(*told["dot"], force, RADIUS),)))
    page.told("flow", lambda m: len(m.get("presses", ())) == done + 1)
    site.runner.ask(commands.HoldPresses(page, ()))


# the folder


@pytest.mark.parametrize("name", NAMES)
def test_names_reach_nothing_else(tmp_path, name):
    inside = tmp_path / "in"
    inside.mkdir()
    (tmp_path / "secret.npz").write_bytes(b"secret")
    with pytest.raises(DataError):
        Folder(inside).existing(name)
    with pytest.raises(DataError):
        Folder(inside).free(name, "")


def test_links_and_folders_are_no_files(tmp_path):
    (tmp_path / "secret.npz").write_bytes(b"secret")
    inside = tmp_path / "in"
    inside.mkdir()
    (inside / "link.npz").symlink_to(tmp_path / "secret.npz")
    (inside / "folder.npz").mkdir()
    (inside / "run.mcap").write_bytes(b"run")
    (inside / "notes.txt").write_bytes(b"not listed")
    folder = Folder(inside)
    assert [file.name for file in folder.list_files()[0]] == ["run.mcap"]
    for name in ("link.npz", "folder.npz", "none.npz"):
        with pytest.raises(DataError, match="no such file"):
            folder.existing(name)
    with pytest.raises(DataError, match=r"ends in \.npz"):
        folder.existing("run.mcap", ".npz")
    assert folder.existing("run.mcap").read_bytes() == b"run"


def test_names_that_no_page_may_ask_for_are_counted(tmp_path, prepared):
    names = (b"run.mcap", b"skin.toml", b"two words.toml", b"a.b.toml", b"\xff.txt")
    try:
        for name in (*names, b"sk\xffn.toml", b"r\xff.mcap"):
            path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/" + name))
            path.write_text(prepared.skin.to_toml())
    except OSError as error:
        pytest.skip(f"names are text here: {error}")
    files, others = Folder(tmp_path).list_files()
    assert {file.name for file in files} == {"run.mcap", "skin.toml", "a.b.toml"}
    assert others == 3
    assert Folder(tmp_path).skins() == ["skin"]


def test_only_settings_of_skins_and_robots_are_listed(tmp_path, prepared):
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "x"\n')
    (tmp_path / "broken.toml").write_text("[outline")
    (tmp_path / "mine.toml").write_text(prepared.skin.to_toml())
    (tmp_path / "arm.toml").write_text('[[skin]]\nname = "hand"\nskin = "textile-disc-8"\n')
    folder = Folder(tmp_path)
    assert folder.skins() == ["mine"]
    assert {file.name for file in folder.list_files()[0]} == {"mine.toml", "arm.toml"}


def test_a_name_that_is_taken_gets_a_number(tmp_path):
    folder = Folder(tmp_path)
    for expected in ("run.csv", "run-2.csv", "run-3.csv"):
        path = folder.free("run", ".csv")
        assert path.name == expected
        path.touch()


def test_a_folder_that_is_gone_is_said(tmp_path):
    with pytest.raises(DataError, match="cannot be read"):
        Folder(tmp_path / "gone").list_files()


# security


@pytest.mark.parametrize("name", NAMES)
def test_no_request_takes_such_a_name(flows, name):
    _, page = flows
    others = (("rename", {"to": "x"}), ("delete", {}), ("annotate", {"text": "x"}))
    named = (("open", {}), ("export", {"format": "npz"}), ("calibration", {}), *others)
    for kind, fields in named:
        page.ask(kind, name=name, **fields)
        assert "not understood" in page.told("error")["message"] or name == "run.txt"
    page.ask("flow_keep", name=name)
    page.told("error")
    page.ask("files")
    assert page.told("files")["files"] == []


def test_the_download_stays_in_the_folder(flows, tmp_path):
    site, _ = flows
    (tmp_path / "secret.npz").write_bytes(b"secret")
    (tmp_path / "sessions" / "a.npz").write_bytes(b"numbers")
    (tmp_path / "sessions" / "b.npz").symlink_to(tmp_path / "secret.npz")
    with site.client() as client:
        answer = client.get("/files/a.npz")
        assert answer.content == b"numbers"
        assert answer.headers["content-disposition"] == 'attachment; filename="a.npz"'
        assert answer.headers["x-content-type-options"] == "nosniff"
        for name in (
            "../secret.npz",
            "..%2Fsecret.npz",
            "%2e%2e/secret.npz",
            "b.npz",
            "none.npz",
            "%2Fetc%2Fpasswd",
            "a.npz%00",
            "...npz",
        ):
            answer = client.get(f"/files/{name}")
            assert answer.status_code == 404, name
            assert b"secret" not in answer.content
        rebound = client.get("/files/a.npz", headers={"Host": f"evil.example:{site.port}"})
        assert rebound.status_code == 403
    with site.client(entered=False) as client:
        assert client.get("/files/a.npz").status_code == 403


def test_malformed_and_oversized_requests_leave_the_connection(flows):
    site, page = flows
    for kind, fields in (
        ("connect", {"source": 7}),
        ("connect", {"source": "x" * 300}),
        ("flow_begin", {"kind": "everything"}),
        ("export", {"name": "run.mcap", "format": "exe"}),
        ("note", {"text": "x" * 40_000}),
        ("files", {"path": "/"}),
    ):
        page.ask(kind, **fields)
        page.told("error")
    for source in ("serial:/dev/null", "replay:/etc/passwd", "twin:seed=1", "tcp:evil.example"):
        page.ask("connect", source=source)
        assert "one of the listed sources" in page.told("error")["message"]
    assert site.runner.status().source.startswith("twin")
    page.ask("files")
    page.told("files")


# files, replay, export


def test_a_session_is_recorded_listed_exported_played_and_left(flows, tmp_path):
    site, page = flows
    runner = site.runner
    until = Watch(runner).until
    until(lambda: runner.newest and runner.newest.result.ready)
    path = tmp_path / "sessions" / "run.mcap"
    runner.ask(commands.Record(path))
    page.ask("open", name="run.mcap")
    assert "still being recorded" in page.told("error")["message"]
    runner.ask(commands.HoldPresses(page, (Press(0.03, 0.02, 5.0, 0.015),)))
    until(lambda: runner.newest.result.touches)
    runner.ask(commands.HoldPresses(page, ()))
    until(lambda: not runner.newest.result.touches)
    runner.ask(commands.StopRecording())
    for form, name in (("touches", "run-touches.csv"), ("npz", "run.npz"), ("npz", "run-2.npz")):
        page.ask("export", name="run.mcap", format=form)
        assert page.told("exported")["name"] == name
    with (tmp_path / "sessions" / "run-touches.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["id"] for row in rows} == {"1"}
    with SessionReader(path) as session:
        start, length = first_scan(session), end_time(session) - start_time(session)
        channels = session.device()["channels"]
    assert 0 <= float(rows[0]["elapsed_s"]) < length
    assert float(rows[0]["time_s"]) - float(rows[0]["elapsed_s"]) == pytest.approx(start, abs=1e-5)
    page.ask("open", name="run.mcap")
    scene = page.told("scene")
    assert scene["source"] == "textile-disc-8 on replay:run.mcap"
    assert (scene["pressable"], scene["truth"]) == (False, True)
    until(lambda: runner.newest and runner.newest.truth)
    assert runner.newest.truth == (Press(0.03, 0.02, 5.0, 0.015),), "as it was recorded"
    assert page.told("timeline")["touches"]
    page.ask("files")
    told = page.told("files")
    assert told["playing"] == "run.mcap"
    page.ask("rename", name="run.mcap", to="other")
    assert "is playing" in page.told("error")["message"]
    page.ask("delete", name="run.mcap")
    assert "is playing" in page.told("error")["message"]
    page.ask("sources")
    assert page.told("sources")["board"]["channels"] == channels, "those that were recorded"
    assert {f["name"] for f in told["files"]} >= {"run.mcap", "run.npz", "run-touches.csv"}
    page.ask("flow_begin", kind="touch")
    assert "presses need a live source" in page.told("error")["message"]
    page.ask("live")
    assert page.told("scene")["source"] == "twin of textile-disc-8"
    assert page.told("state")["replay"] is None


def test_a_session_is_renamed_annotated_and_deleted(flows, tmp_path):
    """Never over another file, and its notes go with it."""
    _, page = flows
    folder = tmp_path / "sessions"
    for name in ("run.mcap", "taken.mcap", "run.csv"):
        (folder / name).write_bytes(name.encode())
    page.ask("annotate", name="run.mcap", text=" the left hand\nsoftly ")
    page.told("files", lambda m: "the left hand\nsoftly\n" in [f["notes"] for f in m["files"]])
    page.ask("rename", name="run.mcap", to="taken")
    assert "taken.mcap: exists already" in page.told("error")["message"]
    page.ask("rename", name="run.mcap", to="left")
    named = page.told("files", lambda m: "left.mcap" in [f["name"] for f in m["files"]])
    assert {f["name"]: f["notes"] for f in named["files"]}["left.mcap"].startswith("the left hand")
    assert (folder / "left.mcap").read_bytes() == b"run.mcap"
    assert (folder / "taken.mcap").read_bytes() == b"taken.mcap"
    page.ask("delete", name="run.csv")
    assert "ends in .mcap" in page.told("error")["message"]
    page.ask("delete", name="left.mcap")
    page.told("files", lambda m: "left.mcap" not in [f["name"] for f in m["files"]])
    assert sorted(path.name for path in folder.iterdir()) == ["run.csv", "taken.mcap"]


def test_notes_lead_nowhere_else(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "secret.txt").write_text("secret")
    (tmp_path / "in" / "run.mcap").write_bytes(b"")
    (tmp_path / "in" / "run.notes.txt").symlink_to(tmp_path / "secret.txt")
    folder = Folder(tmp_path / "in")
    assert [file.notes for file in folder.list_files()[0]] == [""]
    with pytest.raises(DataError, match="is a link"):
        folder.annotate("run.mcap", "mine")
    assert (tmp_path / "secret.txt").read_text() == "secret"


def test_a_recording_that_was_named_by_its_path_is_named_by_its_file():
    assert SourceSwitch(None, "replay:/some/where/run.mcap@2,loop").spec == "replay:run.mcap"


def test_what_is_no_session_is_said_and_the_source_goes_on(flows, tmp_path):
    site, page = flows
    (tmp_path / "sessions" / "bad.mcap").write_bytes(b"no session")
    for kind, fields in (("open", {}), ("export", {"format": "csv"})):
        page.ask(kind, name="bad.mcap", **fields)
        assert "bad.mcap" in page.told("error")["message"]
    page.ask("live")
    assert "no recording is being played" in page.told("error")["message"]
    assert site.runner.status().source.startswith("twin")


# sources


def test_a_listed_source_is_connected_and_says_what_it_is(flows):
    site, page = flows
    page.ask("sources")
    told = page.told("sources")
    assert told["current"] == "twin"
    assert {"twin", "emulator"} <= {offer["id"] for offer in told["sources"]}
    first = site.runner.newest
    page.ask("connect", source="twin")
    page.told("scene")
    page.told("state", lambda s: s["reference"]["ready"])
    assert site.runner.newest is not first
    page.ask("sources")
    board = page.told("sources")["board"]
    assert board["firmware"].count(".") == 2
    assert board["name"] == "simulated board"
    assert board["channels"] >= 8


# presses where the dot is


@pytest.fixture(scope="module")
def taught(prepared, tmp_path_factory):
    """(folder, last message, touches where the first press was, recorded with what was learnt)."""
    folder = tmp_path_factory.mktemp("taught")
    with flowing(prepared, folder, opening=quick(prepared.skin)) as (site, page):
        runner = site.runner
        until = Watch(runner).until
        until(lambda: runner.newest and runner.newest.result.ready)
        page.ask("flow_begin", kind="touch")
        told = press_dots(site, page, 10)
        page.ask("flow_keep", name="finger")
        page.told("calibrations", lambda m: m["touch"] == "finger.npz")
        until(lambda: TOUCH.name in runner.prepared.calibrations)
        runner.ask(commands.Record(folder / "run.mcap"))
        runner.ask(commands.HoldPresses(page, (Press(*told["presses"][0], FORCE, RADIUS),)))
        until(lambda: runner.newest.result.touches)
        begun = runner.newest.result.sequence
        until(lambda: runner.newest.result.sequence > begun + 6)
        last = runner.newest.result.touches
        runner.ask(commands.StopRecording())
    return folder, told, last


def test_presses_become_a_calibration(taught, prepared):
    folder, told, last = taught
    assert told["ready"]
    assert told["figures"]["median_mm"] < 30
    assert len(told["figures"]["errors_mm"]) == 10
    assert "mm pressed softly, " in told["text"], "what is promised is promised of both"
    assert "equally hard" not in told["text"]
    assert "as it is, touches miss the dots by" in told["text"], "what it brings is said"
    found = TOUCH.read(folder / "finger.npz")
    assert found.model.presses.xy == pytest.approx(np.array(told["presses"]))
    outline = prepared.skin.outline
    assert outline.contains(found.model.presses.xy).all()
    gaps = np.linalg.norm(found.model.presses.xy[:, None] - found.model.presses.xy, axis=-1)
    assert gaps[np.triu_indices(10, 1)].min() > 0.01
    (touch,) = last
    x, y = told["presses"][0]
    assert np.hypot(touch.detection.x - x, touch.detection.y - y) < 0.015
    assert touch.detection.sd_x > 0.0005


def test_a_run_with_a_calibration_replays_to_the_bit(taught):
    folder, _, _ = taught
    with SessionReader(folder / "run.mcap") as session:
        prepared = as_recorded(session)
        assert TOUCH.name in prepared.calibrations
        recorded = {item.sequence: item.touches for item in session.touches()}
        again = {r.sequence: r.touches for r in replayed(prepared, session)}
    pressed = [number for number, touches in recorded.items() if touches]
    assert len(pressed) > 3
    for number in pressed:
        one, two = (run[number][0].detection for run in (recorded, again))
        assert (one.x, one.y, one.sd_x, one.cov_xy) == (two.x, two.y, two.sd_x, two.cov_xy)


def test_what_a_recording_has_too_is_not_prepared_again_for_it(taught, prepared):
    folder, told, _ = taught
    with SessionReader(folder / "run.mcap") as session:
        second = as_recorded(session, first := as_recorded(session))
        assert second.calibrations[TOUCH.name] is first.calibrations[TOUCH.name]
        assert (second.problem, second.spots) == (first.problem, first.spots)
        dv = first.calibrations[TOUCH.name].model.presses.dv
        locator = Locator.fit(2 * dv, np.array(told["presses"]), pattern=prepared.pattern)
        others = prepared.calibrated(TOUCH.of(locator, prepared.pattern, prepared.skin))
        anew = as_recorded(session, others).calibrations[TOUCH.name]
        assert anew.model.presses.dv == pytest.approx(dv)


def test_a_calibration_of_the_folder_is_switched_on_and_off(taught, prepared):
    folder, _, _ = taught
    with flowing(prepared, folder) as (site, page):
        until = Watch(site.runner).until
        page.ask("calibration", name="finger.npz")
        page.told("calibrations", lambda m: m["touch"] == "finger.npz")
        until(lambda: TOUCH.name in site.runner.prepared.calibrations)
        page.ask("calibration", name=None)
        page.told("calibrations", lambda m: m["touch"] is None)
        until(lambda: TOUCH.name not in site.runner.prepared.calibrations)
        page.ask("calibration", name="none.npz")
        assert "no such file" in page.told("error")["message"]
        page.ask("calibration", name="run.mcap")
        assert ".npz" in page.told("error")["message"]


def test_a_flow_that_no_page_shows_records_nothing(flows):
    site, page = flows
    runner = site.runner
    page.ask("flow_begin", kind="touch")
    dot = press_dots(site, page, 1)["dot"]
    page.ask("flow_show", on=False)
    page.told("flow", lambda m: m["paused"])
    runner.ask(commands.HoldPresses(page, (Press(*dot, FORCE, RADIUS),)))
    before = runner.status().frames
    Watch(runner).until(lambda: runner.status().frames > before + 60)
    with site.connect() as socket:
        other = type(page)(socket)
        told = other.told("flow")
        assert (told["kind"], told["paused"], len(told["presses"])) == ("touch", True, 1)
        other.ask("flow_show", on=True)
        told = page.told("flow", lambda m: not m["paused"])
        assert (told["phase"], len(told["presses"])) == ("rest", 1)
    page.told("flow", lambda m: m["paused"])  # the page that showed it has gone


def test_a_flow_takes_nothing_from_a_recording_that_is_played(flows, tmp_path):
    site, page = flows
    runner = site.runner
    until = Watch(runner).until
    until(lambda: runner.newest and runner.newest.result.ready)
    path = tmp_path / "sessions" / "run.mcap"
    runner.ask(commands.Record(path))
    runner.ask(commands.HoldPresses(page, (Press(0.03, 0.02, FORCE, RADIUS),)))
    until(lambda: runner.newest.result.touches)
    before = runner.status().frames
    until(lambda: runner.status().frames > before + 40)
    runner.ask(commands.HoldPresses(page, ()))
    until(lambda: not runner.newest.result.touches)
    runner.ask(commands.StopRecording())
    page.ask("flow_begin", kind="touch")
    page.told("flow", lambda m: m["phase"] == "press")
    page.ask("open", name="run.mcap")
    assert page.told("flow", lambda m: m["paused"])["presses"] == []
    page.ask("flow_show", on=True)
    page.told("state", lambda m: m["replay"] and m["replay"]["ended"])
    page.ask("live")
    assert page.told("flow", lambda m: not m["paused"])["presses"] == []


def test_a_press_is_taken_back_and_the_flow_left(flows):
    site, page = flows
    page.ask("flow_delete")
    assert "no press" in page.told("error")["message"]
    page.ask("flow_keep", name="early")
    assert "there are no presses to save" in page.told("error")["message"]
    page.ask("flow_begin", kind="touch")
    first = press_dots(site, page, 1)["presses"][0]
    page.ask("flow_keep", name="early")
    assert "more presses are needed" in page.told("error")["message"]
    page.ask("flow_delete")
    told = page.told("flow", lambda m: m["presses"] == [])
    assert told["dot"] == first
    page.ask("flow_end")
    page.told("flow", lambda m: m["kind"] is None)


def test_scrambled_wires_are_found_kept_and_applied(prepared, tmp_path):
    ring = tuple(range(8))
    wiring = ChannelMapping.as_drawn(8).turned(ring, 3, mirrored=True)
    scrambled = wiring.applied(prepared.skin)
    with flowing(prepared, tmp_path, opening=quick(scrambled)) as (
        site,
        page,
    ):
        runner = site.runner
        until = Watch(runner).until
        until(lambda: runner.newest and runner.newest.result.ready)
        page.ask("flow_begin", kind="mapping")
        told = press_dots(site, page, 4)
        assert told["ready"], told["text"]
        assert told["figures"]["mapping"] == wiring.text(ring)
        page.ask("flow_keep", name="mapped")
        page.told("scene")
        saved = Skin.load(tmp_path / "mapped.toml")
        assert saved.electrode_centres == pytest.approx(scrambled.electrode_centres, abs=1e-5)
        until(lambda: runner.newest and runner.newest.result.ready)
        runner.ask(commands.HoldPresses(page, (Press(0.03, 0.05, 5.0, 0.015),)))
        until(lambda: runner.newest.result.touches)
        until(lambda: runner.newest.result.touches[0].detection.snr > 8)
        reading = runner.newest.result.touches[0].detection
        assert np.hypot(reading.x - 0.03, reading.y - 0.05) < 0.02
