"""A robot from the command line: skins placed on links, all live on one page, one recording."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading

import httpx
import pytest

from cli.conftest import tomoskin
from extras.robot.test_robot import URDF
from tomoskin.extras.robot import Robot
from tomoskin.extras.robot.live_option import chosen_robot
from tomoskin.files.session import split_targets

__all__ = ["tomoskin"]

COMMAND = [sys.executable, "-c", "from tomoskin.cli import main; main()"]
PATIENCE = 300


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    return tmp_path / "arm.urdf"


def test_skins_are_placed_in_one_command_each(tomoskin, arm):
    out = arm.with_name("robot.toml")
    words = ("skin", "place", arm, "fore", "--out", out, "--skin", "textile-disc-8")
    code, said, err = tomoskin(*words, "--at", "10/0/30/0/90/0")
    assert code == 0, err
    assert "fore on fore, 1 skins in all" in said
    assert tomoskin(*words, "--name", "palm")[0] == 0
    mesh = ("skin", "place", arm, "upper", "--out", out, "--on-mesh")
    assert tomoskin(*mesh)[0] == 0
    robot = Robot.load(out)
    assert robot.skins[2].skin == "textile-disc-8", "as every other command, where none is named"
    assert [(s.name, s.place.link, s.source) for s in robot.skins] == [
        ("fore", "fore", "twin:seed=1"),
        ("palm", "fore", "twin:seed=2"),
        ("upper", "upper", "twin:seed=3"),
    ]
    assert robot.skins[0].place.pose.position == pytest.approx([0.01, 0, 0.03])
    assert robot.skins[0].place.pose.degrees() == pytest.approx((0, 90, 0))
    assert robot.skins[2].place.pose.position == pytest.approx([0, 0, 0.1])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("four",), 'no link "four"'),
        (("fore", "--on-mesh"), "has no mesh"),
        (("fore", "--at", "1/2"), "expected X/Y/Z"),
        (("fore", "--name", "Left arm"), "small letters"),
        (("fore", "--skin", "textile-disc-9"), "textile-disc-8"),
    ],
)
def test_a_skin_that_cannot_be_placed_leaves_no_file(tomoskin, arm, words, said):
    out = arm.with_name("robot.toml")
    code, _, err = tomoskin("skin", "place", arm, *words, "--out", out)
    assert code in (1, 2)
    assert said in err
    assert not out.exists()


def test_one_that_cannot_be_added_leaves_the_file_as_it_was(tomoskin, arm):
    out = arm.with_name("robot.toml")
    words = ("skin", "place", arm, "fore", "--out", out)
    assert tomoskin(*words)[0] == 0
    before = out.read_text()
    code, _, err = tomoskin(*words)
    assert (code, "two skins have the same name fore" in err) == (1, True)
    assert out.read_text() == before


LEFT = ("--skin", "left=textile-disc-8", "--source", "twin:seed=1")
RIGHT = ("--skin", "right=textile-disc-8", "--source", "twin:seed=2")
SHORT = (*LEFT, *RIGHT)


def test_skins_by_name_are_a_robot(tomoskin, arm):
    out = arm.with_name("robot.toml")
    for name in ("left", "right"):
        words = ("--name", name, "--skin", "textile-disc-8", "--out", out)
        assert tomoskin("skin", "place", arm, "fore", *words)[0] == 0
    written = chosen_robot(out, [], [], [])
    skins = ["left=textile-disc-8", "right=textile-disc-8"]
    for short in (chosen_robot(None, skins, [], []), chosen_robot(None, *split(SHORT), [])):
        assert [(s.name, s.skin, s.source) for s in short.skins] == [
            (s.name, s.skin, s.source) for s in written.skins
        ]
        assert [s.place.link for s in short.skins] == ["", ""]
    assert chosen_robot(None, ["textile-disc-8"], ["twin"], []) is None
    assert chosen_robot(None, ["./a=b.toml"], [], []) is None
    assert len(chosen_robot(None, ["a=./b=c.toml"], [], []).skins) == 1


def split(options):
    """Values of two options by turns."""
    return list(options[1::4]), list(options[3::4])


@pytest.mark.usefixtures("built_page")
def test_all_skins_are_live_on_one_page_and_in_one_file(tomoskin, tmp_path):
    recording = tmp_path / "run.mcap"
    words = ("live", *SHORT, "--port", "0", "--json", "--record", recording)
    with subprocess.Popen([*COMMAND, *map(str, words)], stdout=subprocess.PIPE, text=True) as live:
        try:
            address = json.loads(live.stdout.readline())["address"]
            with httpx.Client(trust_env=False, follow_redirects=True) as client:
                client.get(address)
                while True:
                    skins = client.get(address.replace("/?", "/status?")).json()["skins"]
                    assert all(skin["running"] for skin in skins.values()), skins
                    if all(skin["frames"] > 40 for skin in skins.values()):
                        break
                    threading.Event().wait(0.2)
            live.send_signal(signal.SIGINT)
            last = live.stdout.readlines()[-1]
            assert live.wait(PATIENCE) == 0
        finally:
            live.kill()
    assert json.loads(last)["skins"].keys() == {"left", "right"}
    assert tuple(split_targets(recording)) == ("left", "right")
    code, _, err = tomoskin("session", "info", recording)
    assert (code, "session split" in err) == (1, True)
    assert tomoskin("session", "split", recording)[0] == 0
    code, said, _ = tomoskin("session", "info", tmp_path / "run-left.mcap", "--json")
    assert code == 0
    assert json.loads(said)["frames"] > 20


def test_a_robot_file_says_all(tomoskin, arm):
    out = arm.with_name("robot.toml")
    assert tomoskin("skin", "place", arm, "fore", "--out", out)[0] == 0
    code, _, err = tomoskin("live", "--robot", out, "--skin", "textile-disc-8")
    assert (code, "the robot file names them" in err) == (2, True)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--skin left=textile-disc-8 --skin textile-disc-8", "expected NAME=SKIN"),
        ("--skin textile-disc-8 --skin textile-disc-8", "expected NAME=SKIN"),
        ("--skin a=textile-disc-8 --skin a=textile-disc-8", "two skins have the same name a"),
        ("--skin Left=textile-disc-8", '[[skin]] 1 "Left": expected a name of small letters'),
        ("--skin a=textile-disc-8 --skin b=textile-disc-8 --source twin", "one for each --skin: 2"),
        ("--source twin --source twin", "one for each --skin: 1; got 2"),
        ("--skin a=textile-disc-8 --calibration {c}", "does not say to which skin it belongs"),
        ("--skin a=textile-disc-9", "textile-disc-8"),
        ("--skin a=textile-disc-8 --source serial:/dev/x --skin b=textile-disc-8 "
         "--source serial:/dev/x", "got one for a (serial:/dev/x) and b (serial:/dev/x)"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("built_page")
def test_skins_by_name_that_cannot_be_meant(tomoskin, tmp_path, words, said):
    calibration = tmp_path / "c.npz"
    calibration.write_bytes(b"")
    code, _, err = tomoskin("live", "--port", "0", *words.format(c=calibration).split())
    assert code in (1, 2)
    assert said in " ".join(err.replace("│", " ").split())
