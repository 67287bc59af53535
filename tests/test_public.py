"""The names that others rely on: ``from tomoskin import …``."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import tomoskin
from test_imports import offered
from tomoskin import core
from tomoskin.files import exports, imports, session


@pytest.mark.parametrize("name", tomoskin.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(tomoskin, name) is not None
    assert name in dir(tomoskin)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="Nonsense"):
        _ = tomoskin.Nonsense


def test_the_package_alone_imports_nothing_heavy() -> None:
    code = "import sys, tomoskin; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_no_room_imports_what_only_some_work_needs() -> None:
    slow = ("scipy.stats", "scipy.signal", "matplotlib", "meshio", "dask")
    code = (
        "import sys, tomoskin.files.exports, tomoskin.server, tomoskin.run; "
        f"print([m for m in {slow} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_flow_in_a_few_lines() -> None:
    """The example of the design page, end to end."""
    skin = tomoskin.Skin.load("textile-disc-8")
    model = tomoskin.ForwardModel(
        skin.mesh(), skin.pattern(), contact_impedance=skin.contact_impedance, current=skin.current
    )
    sigma = skin.conductivity
    operator = tomoskin.OneStep(model, prior="noser", alpha=0.05, conductivity=sigma)
    image = operator(0.01 * model.solve(sigma).voltages)
    assert image.values.shape == (len(skin.mesh().cells),)
    assert image.values.mean() < 0  # higher voltages, lower conductivity


def test_the_citation_names_this_version() -> None:
    root = Path(__file__).resolve().parent.parent
    assert f"\nversion: {tomoskin.__version__}\n" in (root / "CITATION.cff").read_text()


def test_every_entry_point_leads_to_a_function() -> None:
    text = (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    for name, value in tomllib.loads(text)["project"]["entry-points"]["tomoskin.sources"].items():
        module, _, function = value.partition(":")
        assert callable(getattr(import_module(module), function)), name


PACKAGES = (
    *("core", "model.mesh", "model.pattern", "model.skin", "model.forward"),
    *("imaging", "board.wire", "board.source", "sensing.signal", "sensing.track"),
    *("sensing.segment", "sensing.fit", "learning", "pipeline", "twin"),
    *("files.messages", "files.session", "files.imports", "files.exports", "run.sinks", "run"),
)


def functions(package: str) -> Iterator[tuple[str, Callable[..., object]]]:
    """Public functions of a package, and public methods of its classes other than records."""
    module = import_module(f"tomoskin.{package}")
    for name in sorted(offered(inspect.getsource(module))):
        thing = getattr(module, name)
        if inspect.isfunction(thing):
            yield name, thing
        elif inspect.isclass(thing):
            for key, value in vars(thing).items():
                method = getattr(value, "__func__", value)
                own = key == "__init__" and not is_dataclass(thing)
                if inspect.isfunction(method) and (own or not key.startswith("_")):
                    yield f"{name}.{key}", method


@pytest.mark.parametrize("package", PACKAGES)
def test_what_takes_a_path_takes_its_name_too(package: str) -> None:
    """By the annotations: str is among them wherever Path is."""
    asked = [
        (name, annotation)
        for name, function in functions(package)
        for parameter in inspect.signature(function).parameters.values()
        if re.search(r"\bPath\b", annotation := str(parameter.annotation))
    ]
    assert [name for name, annotation in asked if "str" not in annotation] == []


def test_names_of_files_as_plain_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Read and written by functions of several rooms."""
    monkeypatch.chdir(tmp_path)
    skin = tomoskin.Skin.load("textile-disc-8")
    session.SessionWriter("empty.mcap", skin).close()
    assert session.session_info("empty.mcap").frames == 0
    assert tomoskin.Session("empty.mcap").skin.identity == skin.identity
    assert imports.is_session("empty.mcap")
    core.save_arrays("a.npz", {"a": np.arange(3)})
    assert core.load_arrays("a.npz")["a"].tolist() == [0, 1, 2]
    core.check_outputs([core.Output("b.csv", {".csv": "a table"})], inputs=["a.npz"])
    assert exports.write_touches("b.csv", []) == 0
    exports.write_vtu("c.vtu", skin.mesh(), {})
    mesh = skin.mesh()
    exports.write_picture("d.svg", mesh, [exports.Panel("", np.ones(len(mesh.cells)), ())], "S")
    assert sorted(p.suffix for p in tmp_path.iterdir()) == [".csv", ".mcap", ".npz", ".svg", ".vtu"]
