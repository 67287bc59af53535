"""The sink of docs/sinks.md, as a package of its own brings it: a module and an entry point."""

from __future__ import annotations

import re
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from files.session.runs import TOUCH
from run.sinks.conftest import result_at
from tomoskin.core import Event, SinkError, stop_workers
from tomoskin.files.messages import Place
from tomoskin.run.sinks import make_sink, sink_names, sink_worker

PAGE = Path(__file__).resolve().parents[3] / "docs" / "sinks.md"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """The page's module and entry point, found as an installed package's are."""
    section = PAGE.read_text(encoding="utf-8").partition("## A sink of your own")[2]
    module, project = re.findall(r"```(?:python|toml)\n(.*?)```", section, re.DOTALL)[:2]
    (points,) = tomllib.loads(project)["project"]["entry-points"].values()
    folder = tmp_path / "my_package"
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "lines.py").write_text(module)
    about = tmp_path / "my_package-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: my_package\nVersion: 1.0\n")
    lines = "".join(f"{name} = {value}\n" for name, value in points.items())
    (about / "entry_points.txt").write_text(f"[tomoskin.sinks]\n{lines}")
    monkeypatch.syspath_prepend(tmp_path)
    yield tmp_path
    for name in ("my_package", "my_package.lines"):
        sys.modules.pop(name, None)


def lines_of(target, stream, news, *messages):
    """What is in the file after a run has said ``messages``."""
    worker = sink_worker(make_sink(f"lines:{target}"), stream, news)
    worker.start()
    news.until(lambda: "sink-open" in news.kinds())
    for message in messages:
        worker.put(message)
    stop_workers([worker])
    return stream.file(target).read_text().splitlines()


@pytest.mark.usefixtures("installed")
def test_a_sink_is_a_module_and_an_entry_point(tmp_path, stream, news):
    assert "lines" in sink_names()
    lost = Event(0.3, "source-lost", "the cable is out")
    frames = result_at(0.1, TOUCH), result_at(0.2)
    lines = lines_of(tmp_path / "touches.txt", stream, news, *frames, lost)
    d = TOUCH.detection
    assert lines == [f"{stream.skin} 4 {d.x} {d.y} 0.0", f"{stream.skin} the cable is out"]


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("import no_such_package", "No module named 'no_such_package'"),
        ("open_lines = int", "ValueError"),
        ("open_lines = str", "expected a Sink with a name, got 'x'"),
    ],
)
def test_a_sink_at_fault_is_named_with_its_package(installed, body, why):
    (installed / "my_package" / "lines.py").write_text(body)
    with pytest.raises(SinkError, match=f"sink lines: cannot be made: .*{why}") as raised:
        make_sink("lines:x")
    assert "my_package.lines:open_lines" in raised.value.hint


@pytest.mark.usefixtures("installed")
def test_each_skin_of_a_robot_has_a_file_without_the_sinks_doing(tmp_path, stream, news):
    left = replace(stream, skin="left", place=Place("left"))
    (line,) = lines_of(tmp_path / "touches.txt", left, news, result_at(0.1, TOUCH))
    assert line.startswith("left 4 ")
    assert [path.name for path in tmp_path.glob("*.txt")] == ["touches-left.txt"]
