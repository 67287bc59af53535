"""Every command with an output: what it never writes over, and what it does when told to."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import meshio
import numpy as np
import pytest
import typer

from doc_tables import examples
from files.session.runs import write_all
from shapes import disc
from tomoskin.cli import image as image_module
from tomoskin.cli.app import COMMANDS, Commands
from tomoskin.cli.image import WRITERS as IMAGE_WRITERS
from tomoskin.cli.named_files import RECORDING, ForceFlag, Otherwise, Reads, Writes
from tomoskin.cli.session import EXPORTS
from tomoskin.core import RECORDING as SESSION_ENDINGS, OutputError, registered
from tomoskin.core.user_files import MAGIC
from tomoskin.files.exports import WRITERS as EXPORT_WRITERS
from tomoskin.model.forward import ForwardModel
from tomoskin.model.skin import Skin

Run = Callable[..., tuple[int, str, str]]
COARSE = Skin.load("textile-disc-8").altered({"mesh": {"cells": 300}})


@dataclass(frozen=True)
class Case:
    """A command line with one output, and the ending of that; the first input is its own.

    ``makes``: what other cases call its output, where they read it.
    """

    words: str
    ending: str
    options: tuple[str, ...] = ()
    makes: str = ""

    def line(self, files: dict[str, Path], out: Path, *more: str) -> list[str]:
        """With the ``files`` by their names."""
        words = [word.format(out=out, **files) for word in self.words.split()]
        return [*words, *self.options, *more]

    @property
    def reads(self) -> str:
        """The name of the first file that it reads."""
        return next(w[1:-1] for w in self.words.split() if w[0] == "{" and w != "{out}")


CASES = {
    ("image", "out"): Case("image {presses} --skin {skin} --out {out}", ".npz"),
    ("image", "touches"): Case("image {presses} --skin {skin} --touches {out}", ".csv"),
    ("image", "deformations"): Case("image {presses} --skin {skin} --deformations {out}", ".csv"),
    ("image", "thorough"): Case("image {presses} --skin {skin} --thorough {out}", ".csv"),
    ("locate", "touches"): Case(
        "locate {presses} --calibration {calibration} --touches {out}", ".csv"
    ),
    ("calibrate touch", "out"): Case(
        "calibrate touch {presses} --out {out}", ".npz", makes="calibration"
    ),
    ("calibrate force", "out"): Case(
        "calibrate force {presses} --skin {skin} --out {out}", ".npz", ("--weight", "4=0:16")
    ),
    ("calibrate depth", "out"): Case(
        "calibrate depth {presses} --skin {skin} --out {out}", ".npz", ("--depth", "1=0:16")
    ),
    ("calibrate mapping", "out"): Case(
        "calibrate mapping {presses} --skin {skin} --out {out}", ".toml"
    ),
    ("skin alpha", "out"): Case("skin alpha {skin} --rule light-touch --out {out}", ".png"),
    ("skin lay", "out"): Case("skin lay {surface} --electrodes {places} --out {out}", ".toml"),
    ("session export", "out"): Case("session export {session} {out}", ".csv"),
    ("session export", "touches"): Case("session export {session} {other} --touches {out}", ".csv"),
    ("session export", "deformations"): Case(
        "session export {session} {other} --deformations {out}", ".csv"
    ),
    ("session import", "out"): Case("session import {presses} {out}", ".npz"),
}
"""One for each output that may be written over with --force; extras have theirs beside their
tests."""

for file in sorted((Path(__file__).parents[1] / "extras").glob("*/outputs.toml")):
    for given, more in tomllib.loads(file.read_text(encoding="utf-8")).items():
        CASES[tuple(given.rsplit(" ", 1))] = Case(**more)  # type: ignore[index]

NEW_ONLY = {
    ("record", "file"): Case("record {out} --skin {skin} --source twin:fast --frames 1", ".mcap"),
    ("live", "record"): Case("live --skin {skin} --record {out} --port 0", ".mcap"),
    ("session repair", "out"): Case("session repair {session} --out {out}", ".mcap"),
}
"""One for each output that is always a new recording."""

if ("simulate", "out") not in CASES:
    NEW_ONLY["simulate", "out"] = Case(
        "simulate --script {script} --skin {skin} --out {out}", ".mcap"
    )

BOTH = [pytest.param(case, id=" ".join(name)) for name, case in (CASES | NEW_ONLY).items()]
FORCED = [pytest.param(case, id=" ".join(name)) for name, case in CASES.items()]
LONG = {"skin alpha out", "design out"}
"""Work of many seconds before they write."""


def force(case: Case) -> tuple[str, ...]:
    return ("--force",) if case in CASES.values() else ()


# What there is to read: for the refusals nothing of use, so that whoever looks at it says so.

NAMES = {
    "presses": ".npz", "bends": ".npz", "calibration": ".npz", "skin": ".toml",
    "surface": ".stl", "places": ".csv", "session": ".mcap", "script": ".toml",
    "rubbed": ".npz",
} | {case.makes: case.ending for case in CASES.values() if case.makes}  # fmt: skip


@pytest.fixture
def broken(tmp_path: Path) -> dict[str, Path]:
    folder = tmp_path / "broken"
    folder.mkdir()
    files = {name: folder / f"{name}{ending}" for name, ending in NAMES.items()}
    for path in files.values():
        path.write_bytes(b"\x00 broken")
    return files | {"other": folder / "other.csv"}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Small inputs that every command can work with."""
    folder = tmp_path_factory.mktemp("whole")
    files = {name: folder / f"{name}{ending}" for name, ending in NAMES.items()}
    files["skin"].write_text(COARSE.to_toml())
    write_all(files["session"])
    files["script"].write_text(examples("simulate.md")[0])
    np.savez(files["presses"], **presses())
    np.savez(files["rubbed"], **{key: v for key, v in presses(160).items() if key != "xy_m"})
    np.savez(files["bends"], **bends())
    flat = np.pad(1e3 * disc(cells=300).points, ((0, 0), (0, 1)))
    meshio.write(files["surface"], meshio.Mesh(flat, [("triangle", disc(cells=300).cells)]))
    turn = 2 * np.pi * np.arange(8) / 8
    np.savetxt(files["places"], 100 * np.c_[np.cos(turn), np.sin(turn), 0 * turn], "%.3f", ",")
    for case in filter(lambda case: case.makes, CASES.values()):
        with pytest.raises(SystemExit) as end:
            import_module("tomoskin.cli").main(case.line(files, files[case.makes]))
        assert not end.value.code
    return files


def presses(n: int = 16) -> dict[str, Any]:
    """Labelled presses of the coarse skin, with noise."""
    rng, pattern = np.random.default_rng(3), COARSE.pattern()
    model = ForwardModel(COARSE.mesh(), pattern, COARSE.contact_impedance, COARSE.current)
    state = model.at(COARSE.conductivity)
    turn = rng.uniform(0, 2 * np.pi, n)
    xy = 0.06 * np.sqrt(rng.random(n))[:, None] * np.c_[np.cos(turn), np.sin(turn)]
    near = [np.linalg.norm(model.mesh.centroids - place, axis=1) < 0.02 for place in xy]
    touches = [(np.flatnonzero(n), np.full(n.sum(), 0.7 * COARSE.conductivity)) for n in near]
    values = state.local.voltages_of(touches)
    return _frames(values, state.voltages, rng) | {"xy_m": xy}


def bends() -> dict[str, Any]:
    """Frames whose change grows with an angle: 0, 30 and 60 degrees."""
    rng, pattern = np.random.default_rng(4), COARSE.pattern()
    model = ForwardModel(COARSE.mesh(), pattern, COARSE.contact_impedance, COARSE.current)
    rest = model.solve(COARSE.conductivity).voltages
    angle = np.repeat([0.0, 30.0, 60.0], 8)[:, None]
    return _frames(rest * (1 + 1e-3 * angle * rng.random(len(rest))), rest, rng)


def _frames(values: np.ndarray, rest: np.ndarray, rng: np.random.Generator) -> dict[str, Any]:
    noise = rng.normal(0.0, 2e-5, values.shape)
    pattern = COARSE.pattern()
    return {"voltages": values + noise, "reference": rest,
            "drive": pattern.drive, "measure": pattern.measure}  # fmt: skip


# Refusals, all before anything of the input is looked at.


@pytest.mark.parametrize("case", BOTH)
def test_an_input_stays_as_it_is(tomoskin: Run, broken: dict[str, Path], case: Case) -> None:
    mine = broken[case.reads]
    code, _, err = tomoskin(*case.line(broken, mine, *force(case)))
    assert (code, mine.read_bytes()) == (2, b"\x00 broken")
    assert "and an input is never overwritten" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", ["run.mcap", "run{}"])
@pytest.mark.parametrize("case", BOTH)
def test_a_recording_stays_as_it_is(
    tomoskin: Run, tmp_path: Path, broken: dict[str, Path], case: Case, name: str
) -> None:
    recording = tmp_path / name.format(case.ending)
    recording.write_bytes(MAGIC)
    code, _, err = tomoskin(*case.line(broken, recording, *force(case)))
    assert (code, recording.read_bytes()) == (2, MAGIC)
    assert "a recording is never overwritten" in err


@pytest.mark.parametrize("case", BOTH)
def test_a_file_stays_unless_it_is_said(
    tomoskin: Run, tmp_path: Path, broken: dict[str, Path], case: Case
) -> None:
    mine = tmp_path / f"mine{case.ending}"
    mine.write_bytes(b"mine")
    code, _, err = tomoskin(*case.line(broken, mine))
    assert (code, mine.read_bytes()) == (2, b"mine")
    assert f"{mine}: exists already" in err
    assert ("--force" in err) == (case in CASES.values())


@pytest.mark.parametrize("case", BOTH)
def test_where_nothing_can_be_written_is_said_before_the_work(
    tomoskin: Run, tmp_path: Path, broken: dict[str, Path], case: Case
) -> None:
    target = tmp_path / "no such folder" / f"x{case.ending}"
    folders = "--presses" in case.words  # it makes them, and may fill one
    if not folders:
        code, _, err = tomoskin(*case.line(broken, target))
        assert (code, "there is no folder" in err) == (2, True)
    code, _, err = tomoskin(*case.line(broken, tmp_path))
    assert ((code, "got a folder" in err) == (2, True)) != folders
    code, _, err = tomoskin(*case.line(broken, tmp_path / "x.doc"))
    assert (code, f"{case.ending} (" in err) == (2, True)


# With --force.


@pytest.mark.parametrize("case", FORCED)
def test_a_failure_leaves_the_old_file(
    tomoskin: Run, tmp_path: Path, broken: dict[str, Path], case: Case
) -> None:
    """What is broken is looked at only when the output may be written: code 1, not 2."""
    mine = tmp_path / f"mine{case.ending}"
    mine.write_bytes(b"mine")
    code, _, err = tomoskin(*case.line(broken, mine, "--force"))
    assert (code, mine.read_bytes()) == (1, b"mine")
    assert str(broken[case.reads].parent) in err
    assert sorted(tmp_path.iterdir()) == [tmp_path / "broken", mine]


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(*case.values, id=case.id, marks=[pytest.mark.slow] * (case.id in LONG))
        for case in FORCED
    ],
)
def test_with_force_a_file_is_written_over(
    tomoskin: Run,
    tmp_path: Path,
    whole: dict[str, Path],
    case: Case,
) -> None:
    mine = tmp_path / f"mine{case.ending}"
    mine.write_bytes(b"mine")
    code, _, err = tomoskin(*case.line(whole | {"other": tmp_path / "x.csv"}, mine, "--force"))
    assert code == 0, err
    assert mine.read_bytes() != b"mine"
    assert sorted(tmp_path.iterdir()) in ([mine], [mine, tmp_path / "x.csv"])


# What belongs to one command.


@pytest.mark.parametrize("named", ["left=", ""])
def test_a_skin_that_is_named_is_an_input(
    named: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    skin = tmp_path / "a=b.toml"
    skin.write_text(Skin.load("textile-disc-8").to_toml(), encoding="utf-8")
    words = ["live", "--skin", f"{named}{skin}", "--record", str(skin), "--port", "0"]
    with pytest.raises(SystemExit) as end:
        import_module("tomoskin.cli").main(words)
    assert end.value.code
    assert "and an input is never overwritten" in capfd.readouterr().err


def test_two_outputs_are_two_files(
    tomoskin: Run, tmp_path: Path, broken: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("session", "export", broken["session"], "x.csv", "--touches", "./X.csv", "--force")
    code, _, err = tomoskin(*words)
    assert (code, "is the same file as OUT x.csv" in err) == (2, True)


def test_a_repair_without_a_name_keeps_what_has_it(tomoskin: Run, broken: dict[str, Path]) -> None:
    mended = broken["session"].with_name("session.repaired.mcap")
    mended.write_bytes(b"mine")
    code, _, err = tomoskin("session", "repair", broken["session"])
    assert (code, mended.read_bytes()) == (2, b"mine")
    assert err.startswith(f"tomoskin: {mended}: exists already")


@pytest.mark.parametrize("ending", [".vtu", ".pvd"])
def test_the_parts_of_a_series_are_outputs_too(
    tomoskin: Run, tmp_path: Path, broken: dict[str, Path], ending: str
) -> None:
    (tmp_path / "x_000001.vtu").write_text("mine")
    code, _, err = tomoskin("session", "export", broken["session"], tmp_path / f"x{ending}")
    assert (code, "x_000001.vtu: exists already" in err) == (2, True)


def test_endings_are_those_of_what_writes() -> None:
    assert set(EXPORTS) == set(EXPORT_WRITERS)
    assert set(image_module.IMAGES) == set(IMAGE_WRITERS)
    assert RECORDING == SESSION_ENDINGS


# No command can forget it.

OUTPUT_WORDS = {"out", "output", "to", "into", "dest", "save", "record", "touches", "write"}
"""Names of parameters that are outputs, whatever their type."""


def commands() -> Iterator[tuple[str, Callable[..., None]]]:
    """Every command as it is registered, by its words."""
    found: dict[str, Any] = {name: entry.load() for name, entry in registered("commands").items()}
    for name in COMMANDS:
        module = import_module(f"tomoskin.cli.{name}")
        found[name] = getattr(module, "app", None) or getattr(module, name)
    for name, command in found.items():
        prefix, app = f"{name} ", command
        if not isinstance(command, typer.Typer):
            prefix, app = "", Commands()
            app.command(name)(command)
        for info in app.registered_commands:
            assert info.callback is not None
            yield prefix + (info.name or info.callback.__name__), info.callback


ALL = dict(commands())


def marks(command: Callable[..., None]) -> dict[str, tuple[Any, list[Any]]]:
    """Each parameter's annotation without its marks, and the marks."""
    hints = get_type_hints(inspect.unwrap(command), include_extras=True)
    return {
        name: (
            hints[name],
            [m for m in get_args(hints[name]) if isinstance(m, Reads | Writes | Otherwise)],
        )
        for name in inspect.signature(command).parameters
    }


@pytest.mark.parametrize("name", ALL)
def test_every_file_is_marked_as_read_or_written(name: str) -> None:
    for parameter, (hint, found) in marks(ALL[name]).items():
        named = "Path" in str(hint) or parameter in OUTPUT_WORDS
        assert len(found) == named, f"{name} {parameter}: Reads(), Writes(…) or Otherwise(why)?"


@pytest.mark.parametrize("name", ALL)
def test_every_command_that_writes_is_guarded_and_takes_force(name: str) -> None:
    command, found = ALL[name], marks(ALL[name])
    writes = [mark for _, own in found.values() for mark in own if isinstance(mark, Writes)]
    assert (inspect.unwrap(command) is not command) == bool(writes)
    replaces = any(set(mark.endings) - set(RECORDING) for mark in writes)
    assert ("force" in found) == replaces
    if replaces:
        assert found["force"][0] == ForceFlag


def test_every_output_is_tried_here() -> None:
    written = {
        (name, parameter)
        for name, command in ALL.items()
        for parameter, (_, own) in marks(command).items()
        if any(isinstance(mark, Writes) for mark in own)
    }
    assert written == set(CASES | NEW_ONLY)


def planted(
    out: Annotated[Path, typer.Option(), Writes({".csv": "a table"})],
    notes: Annotated[Path, typer.Option(), Reads()],
) -> None:
    """A command that reads and writes."""
    out.write_text(notes.read_text())


def test_a_planted_command_is_guarded(tmp_path: Path) -> None:
    app, out, notes = Commands(), tmp_path / "x.csv", tmp_path / "notes.csv"
    app.command()(planted)
    run = partial(typer.main.get_command(app), standalone_mode=False)
    notes.write_text("mine")
    run(["--out", str(out), "--notes", str(notes)])
    assert out.read_text() == "mine"
    for refused in (out, notes):
        with pytest.raises(OutputError):
            run(["--out", str(refused), "--notes", str(notes)])
