"""``tomoskin doctor``, and what is common to all commands."""

import json
import subprocess
import sys

import pytest

from tomoskin import __version__
from tomoskin.board.wire import GetLosses, Losses
from tomoskin.cli import app as commands, main
from tomoskin.core import SinkError
from tomoskin.run.sinks import sink_names
from tomoskin.server import check_page
from tomoskin.twin.held_scanning import HeldScanning


def test_doctor(tomoskin):
    code, out, _ = tomoskin("doctor", "--json")
    report = json.loads(out)
    assert report["ok"] is (code == 0)
    assert report["version"] == __version__
    found = {}
    for finding in report["findings"]:
        found.setdefault(finding["name"], []).append(finding)
    assert found["python"][0]["ok"]
    assert "twin" in found["sources"][0]["text"]
    assert len(found["skin"]) == 5
    assert all(skin["ok"] for skin in found["skin"])
    sinks = found.get("sink", [])
    assert len(sinks) == len(sink_names())
    assert all(sink["optional"] for sink in sinks)  # none of them is needed
    assert "8765" in found["port"][0]["text"]


def test_a_sink_without_its_package_is_not_ok_and_no_fault(tomoskin, monkeypatch):
    def missing(spec):
        raise SinkError("needs the package", where=f"sink {spec}")

    healthy = tomoskin("doctor")[0]
    monkeypatch.setattr("tomoskin.run.sinks.make_sink", missing)
    code, out, _ = tomoskin("doctor")
    assert code == healthy
    lines = [line for line in out.splitlines() if "needs the package" in line]
    assert len(lines) == len(sink_names())
    assert all(line.startswith("-     sink ") for line in lines)


@pytest.mark.parametrize(("lost", "ok"), [((0, 0), True), ((3, 0), False), ((0, 2), False)])
def test_doctor_asks_a_board_what_it_has_lost(tomoskin, monkeypatch, lost, ok):
    answer = HeldScanning.answer
    monkeypatch.setattr(
        HeldScanning,
        "answer",
        lambda self, command: (
            Losses(command.request, *lost)
            if isinstance(command, GetLosses)
            else answer(self, command)
        ),
    )
    _, out, _ = tomoskin("doctor", "--json", "--source", "twin")
    (found,) = [one for one in json.loads(out)["findings"] if one["name"] == "board"]
    assert found["ok"] is ok
    assert f"late {lost[0]} times" in found["text"]
    assert f"lost {lost[1]} times" in found["text"]


def test_doctor_says_that_no_board_answers(tomoskin):
    code, out, _ = tomoskin("doctor", "--source", "serial:/dev/none")
    assert code == 1
    assert "FAIL  board" in out


def test_doctor_for_people(tomoskin):
    _, out, _ = tomoskin("doctor")
    assert "numpy" in out
    assert "scipy" in out


def test_doctor_says_what_fails(tomoskin, monkeypatch, tmp_path):
    monkeypatch.setattr("tomoskin.server.check_page", lambda: check_page(tmp_path))
    code, out, _ = tomoskin("doctor")
    assert code == 1
    assert "FAIL  page" in out
    assert "make live" in out


def test_version(tomoskin):
    assert tomoskin("--version") == (0, f"tomoskin {__version__}\n", "")


def test_an_unknown_command_is_wrong_usage(tomoskin):
    assert tomoskin("levitate")[0] == 2


def test_an_error_of_our_own_is_a_sentence(tomoskin, monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("oh dear")

    monkeypatch.delenv("TOMOSKIN_DEBUG", raising=False)
    monkeypatch.setattr(commands, "app", broken)
    code, _, errors = tomoskin("doctor")
    assert code == 1
    assert errors.startswith("tomoskin: internal error, ZeroDivisionError: oh dear")
    assert "TOMOSKIN_DEBUG=1" in errors
    assert len(errors.splitlines()) == 1


def test_the_traceback_is_there_for_who_wants_it(monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("oh dear")

    monkeypatch.setenv("TOMOSKIN_DEBUG", "1")
    monkeypatch.setattr(commands, "app", broken)
    with pytest.raises(ZeroDivisionError):
        main(["doctor"])


def test_heavy_rooms_are_not_imported_at_the_start():
    heavy = ("scipy", "starlette", "uvicorn", "serial", "matplotlib")
    code = f"import sys, tomoskin.cli; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
