"""What would be released: the files in it, one version everywhere, and that it runs by itself."""

from __future__ import annotations

import importlib
import json
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

from conftest import missing
from firmware.emulator.pico import check_boot
from tomoskin import __version__

pytestmark = pytest.mark.slow  # make release looks at the same

ROOT = Path(__file__).resolve().parent.parent
STATIC = "tomoskin/server/static/"
IMAGES = "tomoskin_emulator/images/"
MOST_MB = 6.0


@pytest.fixture(scope="module")
def release() -> ModuleType:
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "scripts"))
        return importlib.import_module("release")


@pytest.fixture(scope="module")
def built(release, tmp_path_factory) -> tuple[Path, Path]:
    """Return the sdist and the wheel made of it; the page must be built."""
    fresh = [sys.executable, "scripts/page.py", "fresh"]
    if subprocess.run(fresh, cwd=ROOT, check=False).returncode:
        missing("the release: the page has not been built (make page)")
    return release.pure(tmp_path_factory.mktemp("release"))


@pytest.fixture(scope="module")
def wheel(built) -> list[str]:
    with zipfile.ZipFile(built[1]) as archive:
        return archive.namelist()


@pytest.fixture(scope="module")
def sdist(built) -> list[str]:
    with tarfile.open(built[0]) as archive:
        return [name.partition("/")[2] for name in archive.getnames()]


@pytest.fixture(scope="module")
def empty(release, built, tmp_path_factory: pytest.TempPathFactory):
    """An environment with the wheel and what it asks for, and nothing else."""
    return release.Environment(tmp_path_factory.mktemp("environment"), [built[1]])


def test_the_built_page_is_in_both(wheel: list[str], sdist: list[str]) -> None:
    assert STATIC + "index.html" in wheel
    assert {Path(name).suffix for name in wheel if name.startswith(STATIC)} >= {".js", ".css"}
    page = {name for name in wheel if name.startswith(STATIC)}
    assert {f"src/{name}" for name in page} <= set(sdist)


def test_the_firmware_of_both_boards_is_in_both(wheel: list[str], sdist: list[str], built) -> None:
    if shutil.which("avr-gcc") is None:
        missing("the firmware in a wheel: no avr-gcc (Debian: apt-get install gcc-avr avr-libc)")
    if shutil.which("arm-none-eabi-gcc") is None:
        missing("the Pico's firmware in a wheel (Debian: apt-get install gcc-arm-none-eabi)")
    images = {f"{IMAGES}tomoskin-{channels}.hex" for channels in (8, 16)}
    images |= {f"{IMAGES}tomoskin-pico-{channels}.bin" for channels in (8, 16, 32)}
    assert images <= set(wheel)
    assert {f"src/{name}" for name in images} <= set(sdist)
    with zipfile.ZipFile(built[1]) as archive:
        for name in images:
            if name.endswith(".hex"):
                assert archive.read(name).splitlines()[-1] == b":00000001FF"  # it is whole
            else:
                check_boot(archive.read(name))


def test_every_file_of_the_library_is_in_it(wheel: list[str]) -> None:
    source = ROOT / "src"
    suffixes = {".py", ".toml", ".typed"}
    files = {
        file.relative_to(source).as_posix()
        for file in source.glob("tomoskin/**/*")
        if file.suffix in suffixes and "web" not in file.parts
    }
    assert files - set(wheel) == set()


def test_the_wheel_holds_the_library_and_nothing_else(wheel: list[str]) -> None:
    tops = {name.split("/")[0] for name in wheel}
    assert tops == {"tomoskin", f"tomoskin-{__version__}.dist-info"}
    assert [name for name in wheel if "/web/" in name or "node_modules" in name] == []


def test_the_sdist_holds_the_sources_and_no_recordings(sdist: list[str], built) -> None:
    wanted = {"pyproject.toml", "README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE", "NOTICE"}
    wanted |= {"hatch_build.py", "firmware/Makefile", "core-native/Cargo.toml"}
    assert wanted - set(sdist) == set()
    assert [n for n in sdist if re.search(r"(^|/)(shared|node_modules|target|\.venv)/", n)] == []
    binaries = {name for name in sdist if name.endswith((".mcap", ".npz", ".elf", ".so"))}
    old = {"tests/files/session/of_0_1.mcap"}  # that old files are still read
    old |= {f"tests/learning/files/{kind}.npz" for kind in ("touch", "force", "body", "class")}
    assert binaries == old
    assert max(file.stat().st_size for file in built) < 1e6 * MOST_MB


def test_licences_are_in_it(wheel: list[str]) -> None:
    assert {Path(name).name for name in wheel if "/licenses/" in name} == {"LICENSE", "NOTICE"}


def test_entry_points_are_those_of_the_sources(built) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = {"console_scripts": project["scripts"], **project["entry-points"]}
    with zipfile.ZipFile(built[1]) as archive:
        text = archive.read(f"tomoskin-{__version__}.dist-info/entry_points.txt").decode()
    found: dict[str, dict[str, str]] = {}
    for line in filter(None, text.splitlines()):
        if line.startswith("["):
            group = found[line.strip("[]")] = {}
        else:
            name, _, target = line.partition(" = ")
            group[name] = target
    assert found == wanted


def test_the_version_is_one() -> None:
    """In the package; the rest follows, or is held to it here."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["dynamic"] == ["version"]
    assert project["tool"]["hatch"]["version"]["path"] == "src/tomoskin/__init__.py"
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.MULTILINE) == [__version__]
    core = tomllib.loads((ROOT / "core-native/Cargo.toml").read_text(encoding="utf-8"))
    assert core["package"]["version"] == __version__
    page = json.loads((ROOT / "web/package.json").read_text(encoding="utf-8"))
    assert page["private"] is True  # no package of its own


def test_it_runs_where_nothing_else_is(release, empty) -> None:
    said = {words: empty.said(*words) for words in release.COMMANDS}
    assert said["--version",] == f"tomoskin {__version__}\n"
    assert "textile-disc-8" in said["skin", "list"]
    assert "tomoskin_core is not installed" in said["doctor",]
    assert "FAIL" not in said["doctor",]
    where = release.run(str(empty.python), "-c", "import tomoskin; print(tomoskin.__file__)")
    assert Path(where.strip()).is_relative_to(empty.python.parents[1])


def test_the_live_twin_starts_where_nothing_else_is(empty) -> None:
    assert "twin of textile-disc-8 is live" in empty.serves()


@pytest.mark.slow
def test_the_native_engine_is_found_beside_it(
    release, built, tmp_path_factory: pytest.TempPathFactory
) -> None:
    if reason := release.native.why_not():
        pytest.skip(reason)
    native = release.fast(tmp_path_factory.mktemp("native"))
    both = release.Environment(tmp_path_factory.mktemp("both"), [built[1], native])
    assert "native: tomoskin_core" in both.said("doctor")
