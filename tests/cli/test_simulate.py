"""``tomoskin simulate``: sessions with truth inside, labelled sets, refusals."""

from __future__ import annotations

import json
import signal

import numpy as np
import pytest

import tomoskin.cli.simulate as tomoskin_simulate
from doc_tables import examples
from tomoskin.cli.output import Bar
from tomoskin.files.imports import read_recording
from tomoskin.files.session import SessionReader
from tomoskin.model.skin import Skin

(EXAMPLE,) = examples("simulate.md")

SCRIPT = """format = 1
[script]
duration = "1 s"
lead_in = "300 ms"
[[press]]
id = "a"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "200 ms"
force = "3 N"
hold = "300 ms"
[[mark]]
at = "500 ms"
text = "half"
"""


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(SCRIPT, encoding="utf-8")
    return path


def test_a_session_holds_frames_and_truth_and_is_the_same_again(tomoskin, script, tmp_path):
    first, second = tmp_path / "a.mcap", tmp_path / "b.mcap"
    for out in (first, second):
        code, text, _ = tomoskin("simulate", "--script", script, "--out", out, "--json")
        assert code == 0
    assert first.read_bytes() == second.read_bytes()
    other = tmp_path / "c.mcap"
    tomoskin("simulate", "--script", script, "--out", other, "--seed", 5)
    assert other.read_bytes() != first.read_bytes()
    with SessionReader(first) as session:
        truth = list(session.truth())
        assert [note.text for note in session.notes()] == ["half"]
    recording = read_recording(first)
    assert len(recording) == json.loads(text)["frames"]
    assert max(press["force"] for item in truth for press in item.presses) == pytest.approx(3)
    pressed = np.isfinite(recording.labels[:, 0])
    assert 5 < pressed.sum() < len(recording)
    assert recording.labels[pressed] == pytest.approx(np.tile([0.02, -0.03], (pressed.sum(), 1)))
    change = np.linalg.norm(recording.voltages - recording.voltages[0], axis=1)
    assert change[pressed].max() > 3 * change[~pressed][:5].max()  # idle frames: the noise of two


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SCRIPT.replace("3 N", "-3 N"), '[[press]] 1 "a" force'),
        (SCRIPT.replace("20 mm", "200 mm"), "off the skin"),
    ],
)
def test_bad_scripts_leave_no_file(tomoskin, script, tmp_path, text, message):
    script.write_text(text, encoding="utf-8")
    code, _, error = tomoskin("simulate", "--script", script, "--out", tmp_path / "x.mcap")
    assert code == 1
    assert message in error
    assert not (tmp_path / "x.mcap").exists()


class Stop(Bar):
    """Ctrl-C as soon as something is done."""

    def __call__(self, done, total):
        super().__call__(done, total)
        if done > 0:
            signal.raise_signal(signal.SIGINT)


def test_ctrl_c(tomoskin, script, tmp_path, monkeypatch):
    out = tmp_path / "a.mcap"
    with monkeypatch.context() as patch:
        patch.setattr(tomoskin_simulate, "Bar", Stop)
        code, _, error = tomoskin("simulate", "--script", script, "--out", out)
        assert (code, error) == (
            1,
            f"tomoskin: stopped; {out} holds the simulation until then, "
            "and says that it was stopped\n",
        )
    with SessionReader(out) as session:
        assert [note.text for note in session.notes()][-1].startswith("stopped after")


def test_a_skin_whose_board_does_not_settle(tomoskin, script, tmp_path):
    skin = tmp_path / "fast.toml"
    text = Skin.load("textile-disc-8").to_toml()
    skin.write_text(text.replace('settling = "2 ms"', 'settling = "10 us"'), encoding="utf-8")
    out = tmp_path / "out.mcap"
    code, _, error = tomoskin("simulate", "--skin", skin, "--script", script, "--out", out)
    assert code == 1
    assert f"{skin}: [readout] settling: expected at least 51 us, got 10 us" in error
    assert not out.exists()


def test_wrong_usage(tomoskin, tmp_path):
    out = ("--out", tmp_path / "x.mcap")
    assert tomoskin("simulate", *out)[0] == 2
    assert tomoskin("simulate", "--script", tmp_path / "none.toml", *out)[0] == 1


def test_the_examples_of_the_page(tomoskin, script, tmp_path):
    script.write_text(EXAMPLE, encoding="utf-8")
    assert tomoskin("simulate", "--script", script, "--out", tmp_path / "x.mcap")[0] == 0
