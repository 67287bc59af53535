"""The launch file of examples/ros2: the command that it starts; ROS 2's own launch is not here.

Stand-ins for the few classes of ``launch`` keep what they are given.
"""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import pytest

from tomoskin.run.sinks import make_sink

FOLDER = Path(__file__).resolve().parents[3] / "examples" / "ros2"


class Configuration:
    """A substitution by an argument's name."""

    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context: dict[str, str]) -> str:
        return context[self.name]


@pytest.fixture
def launched(monkeypatch: pytest.MonkeyPatch) -> Any:
    """The words of the process for some arguments."""

    def keep(*values: Any, **named: Any) -> SimpleNamespace:
        return SimpleNamespace(values=values, **named)

    parts: dict[str, dict[str, Any]] = {
        "launch": {"LaunchDescription": list},
        "launch.actions": dict.fromkeys(
            ("DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction"), keep
        ),
        "launch.substitutions": {"LaunchConfiguration": Configuration},
    }
    for name, content in parts.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    script = runpy.run_path(str(FOLDER / "launch" / "tomoskin.launch.py"))
    *declared, opaque = script["generate_launch_description"]()
    defaults = {one.values[0]: one.default_value for one in declared}

    def words(**given: str) -> list[str]:
        assert given.keys() <= defaults.keys()
        (process,) = opaque.function(defaults | given)
        return list(process.cmd)

    return words


@pytest.mark.parametrize(("release", "ending"), [("humble", ",release=humble"), ("jazzy", "")])
def test_the_name_in_the_graph_is_for_the_release(launched: Any, release: str, ending: str) -> None:
    words = launched(release=release)
    assert words[words.index("--sink") + 1] == f"ros2:namespace=tomoskin{ending}"


def test_the_command_is_that_of_the_arguments(launched: Any) -> None:
    words = launched(
        source="serial:auto", parent="tool0", at="0/0/0.05", calibrations="a.npz b.npz"
    )
    assert words[:2] == ["tomoskin", "live"]
    options = list(zip(words[2::2], words[3::2], strict=True))
    assert options == [
        ("--skin", "textile-disc-8"),
        ("--source", "serial:auto"),
        ("--calibration", "a.npz"),
        ("--calibration", "b.npz"),
        ("--sink", "ros2:namespace=tomoskin,parent=tool0,at=0/0/0.05"),
        ("--port", "8765"),
    ]
    sink = make_sink(dict(options)["--sink"])
    assert sink.naming.mount is not None
    assert sink.naming.mount.link == "tool0"
    assert launched(robot="robot.toml")[2:4] == ["--robot", "robot.toml"]


def test_the_package_is_named_as_its_build_names_it() -> None:
    root = ElementTree.parse(FOLDER / "package.xml").getroot()
    assert root.tag == "package"
    name = root.findtext("name")
    assert f"project({name} NONE)" in (FOLDER / "CMakeLists.txt").read_text()
    launch = (FOLDER / "launch" / "tomoskin.launch.py").read_text()
    assert f"ros2 launch {name} tomoskin.launch.py" in launch
