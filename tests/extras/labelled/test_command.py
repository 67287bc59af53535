"""``tomoskin simulate --presses``: labelled sets, and refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cli.test_simulate import SCRIPT, Stop
from doc_tables import examples
from tomoskin.extras.labelled import Population, command
from tomoskin.extras.labelled.population import SHARD_FRAMES
from tomoskin.files.imports import read_recording
from tomoskin.model.skin import Skin

COARSE = Skin.load("textile-disc-8").altered({"mesh": {"cells": 300}})
(EXAMPLE,) = examples("extras/labelled.md")


@pytest.mark.slow
def test_a_set_is_the_same_whoever_makes_it_and_goes_on(tomoskin, tmp_path):
    n = SHARD_FRAMES + 2
    common = ("simulate", "--presses", n, "--seed", 3, "--json")
    one, two, single = tmp_path / "one", tmp_path / "two", tmp_path / "set.npz"
    assert tomoskin(*common, "--out", one, "--processes", 1)[0] == 0
    assert tomoskin(*common, "--out", two, "--processes", 2)[0] == 0
    parts = ["part-00000.npz", "part-00001.npz"]
    assert [(one / p).read_bytes() for p in parts] == [(two / p).read_bytes() for p in parts]
    torn = (two / parts[1]).read_bytes()
    (two / parts[1]).write_bytes(torn[:-100])
    _, text, _ = tomoskin(*common, "--out", two, "--processes", 1)
    assert (json.loads(text)["made"], json.loads(text)["found"]) == (1, 1)
    assert (two / parts[1]).read_bytes() == torn
    code, _, error = tomoskin("simulate", "--presses", n, "--seed", 4, "--out", one)
    assert code == 2
    assert "belongs to another set" in error
    assert tomoskin(*common, "--out", single, "--processes", 1)[0] == 0
    recording = read_recording(single)
    assert len(recording) == n
    assert np.hypot(*recording.labels.T).max() < 0.0951


def test_ctrl_c(tomoskin, tmp_path, monkeypatch):
    drawn = ("simulate", "--presses", 3, "--processes", 1, "--out", tmp_path / "set")
    with monkeypatch.context() as patch:
        patch.setattr(command, "Bar", Stop)
        code, _, error = tomoskin(*drawn)
        assert code == 1
        assert "the same command continues from here" in error
    assert tomoskin(*drawn)[0] == 0


def test_a_skin_whose_board_does_not_settle(tomoskin, tmp_path):
    skin, out = tmp_path / "fast.toml", tmp_path / "out"
    text = Skin.load("textile-disc-8").to_toml()
    skin.write_text(text.replace('settling = "2 ms"', 'settling = "10 us"'), encoding="utf-8")
    code, _, error = tomoskin("simulate", "--skin", skin, "--presses", 3, "--out", out)
    assert code == 1
    assert f"{skin}: [readout] settling: expected at least 51 us, got 10 us" in error
    assert not out.exists()


@pytest.mark.slow
def test_a_cluster_that_is_not_there(tomoskin, tmp_path):
    drawn = ("simulate", "--presses", 3, "--out", tmp_path / "set")
    code, _, error = tomoskin(*drawn, "--cluster", "nonsense://")
    assert code == 1
    assert error.startswith("tomoskin: nonsense://: ")
    assert tomoskin(*drawn, "--cluster", "tcp://127.0.0.1:1", "--processes", 2)[0] == 2


def test_wrong_usage(tomoskin, tmp_path):
    script, out = tmp_path / "my.toml", ("--out", tmp_path / "x.mcap")
    script.write_text(SCRIPT, encoding="utf-8")
    assert tomoskin("simulate", *out)[0] == 2
    assert tomoskin("simulate", "--script", script, "--processes", 2, *out)[0] == 2
    script.write_text(EXAMPLE, encoding="utf-8")
    code, _, error = tomoskin("simulate", "--script", script, *out)
    assert (code, "--presses N" in error) == (1, True)
    assert not (tmp_path / "x.mcap").exists()


def test_the_example_of_the_page():
    assert Population.from_toml(EXAMPLE).count == (1, 3)


def test_labelled_frames_stay_out_of_the_way_of_others(tomoskin, tmp_path):
    """A file of a shard's name that is no shard; and a file where a folder is to be."""
    skin = tmp_path / "skin.toml"
    skin.write_text(COARSE.to_toml())
    words = ("simulate", "--skin", skin, "--presses", "1", "--processes", "1")
    part = tmp_path / "part-00000.npz"
    np.savez(part, mine=np.ones(2))
    mine = part.read_bytes()
    code, _, err = tomoskin(*words, "--out", tmp_path)
    assert (code, part.read_bytes(), "no part of a set" in err) == (2, mine, True)
    code, _, err = tomoskin(*words, "--out", tmp_path / "skin", "--force")
    assert code == 0, err
    (tmp_path / "set").write_text("mine")
    code, _, err = tomoskin(*words, "--out", tmp_path / "set", "--force")
    assert (code, "expected a name that ends in .npz" in err) == (2, True)
    code, _, err = tomoskin(*words, "--out", tmp_path, "--force")
    assert (code, part.read_bytes() != mine) == (0, True)
