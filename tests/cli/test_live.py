"""``tomoskin live`` as a program: its address, its end, and what it says when it cannot start."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
from contextlib import ExitStack
from functools import partial

import httpx
import numpy as np
import pytest
import typer

from tomoskin.cli.live import Served, check_one, live
from tomoskin.cli.named_files import Added
from tomoskin.core import Frame, Mark
from tomoskin.files.session import SessionReader, SessionWriter, session_info
from tomoskin.model.skin import Skin

COMMAND = [sys.executable, "-c", "from tomoskin.cli import main; main()"]
PATIENCE = 300
pytestmark = pytest.mark.usefixtures("built_page")


@pytest.fixture
def start():
    """Start the command as a program of its own; whatever still runs is ended after the test."""
    with ExitStack() as stack:

        def start(*arguments):
            process = subprocess.Popen(
                [*COMMAND, "live", *arguments],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            stack.enter_context(process)
            stack.callback(process.kill)
            return process

        yield start


@pytest.fixture
def refused(tomoskin):
    """Run the command in this process, for it ends before it serves: (exit code, out, errors)."""
    return partial(tomoskin, "live")


def end(process, number):
    process.send_signal(number)
    out, errors = process.communicate(timeout=PATIENCE)
    return process.returncode, out, errors


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_it_serves_at_the_printed_address_and_ends_cleanly(start, number):
    process = start("--port", "0")
    line = process.stdout.readline()
    address = re.fullmatch(
        r"twin of textile-disc-8 is live at (http://127\.0\.0\.1:(\d+)/)(\?token=\S+)\n", line
    )
    assert address, line
    with httpx.Client(trust_env=False, follow_redirects=True) as client:
        assert client.get(address[1]).status_code == 403
        page = client.get(address[1] + address[3])
        assert page.status_code == 200
        assert "<script" in page.text
    assert end(process, number) == (0, "", "")
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", int(address[2]))) != 0


@pytest.mark.parametrize("number", ["SIGINT", pytest.param("SIGTERM", marks=pytest.mark.slow)])
def test_a_signal_before_it_is_ready_is_a_clean_end_too(number):
    code = (
        "import os, signal; from tomoskin import pipeline; from tomoskin.cli import main\n"
        f"pipeline.prepare = lambda skin: os.kill(os.getpid(), signal.{number})\n"
        "main(['live', '--port', '0'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, b"", b"")


def test_a_port_in_use_is_one_sentence(refused):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        code, out, errors = refused("--port", str(port))
    assert (code, out) == (1, "")
    assert errors == (
        f"tomoskin: port {port}: the port is in use, perhaps by another tomoskin "
        "(choose another with --port, or a free one with --port 0)\n"
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--skin", "none"], "none"),
        (["--skin", ""], "not a skin file"),
        (["--source", "telepathy"], "telepathy"),
        (["--source", "twin:backwards"], "backwards"),
        (["--host", "192.0.2.1", "--port", "0"], "192.0.2.1"),
    ],
)
def test_what_cannot_start_is_one_sentence(refused, arguments, said):
    code, _, errors = refused("--port", "0", *arguments)
    assert code == 1
    assert said in errors
    assert len(errors.splitlines()) == 1
    assert errors.startswith("tomoskin: ")


@pytest.mark.parametrize(
    "arguments",
    [["--port", "many"], ["--port", "70000"], ["--nonsense"], ["--folder", "/nowhere/at/all"]],
)
def test_wrong_usage(refused, arguments):
    assert refused(*arguments)[0] == 2


def test_a_recording_that_ends_by_itself_is_said_at_once_and_at_the_end(start, tmp_path):
    """Its file is cut by another program."""
    path = tmp_path / "run.mcap"
    process = start("--port", "0", "--source", "twin:fast", "--record", str(path), "--json")
    assert json.loads(process.stdout.readline())["type"] == "listening"
    while not path.exists() or path.stat().st_size < 1000:
        assert process.poll() is None, process.communicate()
        threading.Event().wait(0.05)
    os.truncate(path, 100)
    line = process.stderr.readline()
    assert "the recording has ended" in line
    assert "another program has changed the file" in line
    code, out, errors = end(process, signal.SIGINT)
    assert (code, errors) == (1, "")
    (ended,) = json.loads(out)["recordings_ended"]
    assert ended in line


def test_it_records_from_the_first_byte_to_the_end(start, tmp_path):
    """In JSON, and for any host, of which it warns."""
    path = tmp_path / "run.mcap"
    process = start(
        *("--port", "0", "--host", "0.0.0.0", "--source", "twin:fast"),
        *("--record", str(path), "--json"),
    )
    started = json.loads(process.stdout.readline())
    assert started["type"] == "listening"
    assert str(started["port"]) in started["address"]
    while session_info(path).frames < 30:
        assert process.poll() is None, process.communicate()
        threading.Event().wait(0.05)
    code, out, errors = end(process, signal.SIGTERM)
    assert code == 0
    assert json.loads(out)["type"] == "stopped"
    (warning,) = errors.splitlines()
    assert "warning: --host 0.0.0.0" in warning
    found = session_info(path)
    assert not found.torn
    assert found.frames >= 30
    with SessionReader(path) as session:
        assert next(session.frames()).mark & Mark.REFERENCE


def test_it_replays_with_the_skin_in_the_file(start, refused, tmp_path):
    path = tmp_path / "run.mcap"
    with SessionWriter(path, Skin.load("textile-disc-16")) as session:
        frame = Frame(0, 0, 0.0, 1, 1, 0, np.full(224, 500, "<u2"))
        session.frame(frame)
    process = start("--port", "0", "--source", f"replay:{path}")
    assert process.stdout.readline().startswith(f"textile-disc-16 on replay:{path.name} ")
    assert end(process, signal.SIGTERM)[0] == 0
    code, _, errors = refused(
        "--port", "0", "--source", f"replay:{path}", "--skin", "textile-disc-32"
    )
    assert code == 1
    assert "leave out --skin" in errors
    code, _, errors = refused("--port", "0", "--source", "replay:none.mcap")
    assert code == 1
    assert "there is no such file" in errors


@pytest.mark.parametrize("given", [(["a", "b"], []), ([], ["twin", "twin"])])
def test_several_are_refused_where_nothing_runs_them(given):
    with pytest.raises(typer.BadParameter, match="expected one, got 2"):
        check_one(*given)


def test_an_option_that_is_added_may_take_over(monkeypatch):
    """It is asked with what was given, and runs in place of the one skin."""
    asked, ran = [], []

    class Several:
        def instead(self, *given):
            asked.append(given)
            return (lambda *served: ran.append(served)) if given[0] else None

    added = Added((Several(),))
    live(added=added, skin=["a", "b"], sink=["lines:x"], early=True, served=Served())
    assert asked == [(["a", "b"], [], [])]
    assert ran == [(["lines:x"], Served(), True)]
    monkeypatch.setattr("tomoskin.cli.live.skin_for_source", lambda *_: pytest.fail("one skin"))
    with pytest.raises(pytest.fail.Exception, match="one skin"):
        live(added=added, served=Served())
