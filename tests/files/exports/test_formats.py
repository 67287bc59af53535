"""Formats of exports that are registered, by the ending of a file's name."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import pytest
import typer

from cli.conftest import tomoskin
from files.session.runs import write_frames
from tomoskin.cli import app, named_files, session
from tomoskin.core import Registered, install_hint
from tomoskin.files.exports import WRITERS, ExportFormat, export_formats, session_export

__all__ = ["tomoskin"]


@dataclass(frozen=True)
class Colour:
    """What the format below takes."""

    colour: Annotated[str, typer.Option(help="Colour of the dust.")] = ""

    def check(self, out: Path, touches: Path | None) -> None:
        del touches
        if self.colour and out.suffix != ".dust":
            raise typer.BadParameter("expected it together with X.dust", param_hint="--colour")

    def applied(self, job):
        return replace(job, options=(*job.options, self))


def write_dust(job, path):
    path.write_text(f"{job.session.path.name} {job.option(Colour).colour}")


DUST = ExportFormat(write_dust, "a cloud of dust")
FOG = ExportFormat(write_dust, "fog", package=("no_such_package", "plot"))


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch):
    """Two formats and an option of a package."""
    names = {"exports": {".dust": DUST, ".fog": FOG}, "options": {"session export colour": Colour}}

    def known(seam):
        entries = names.get(seam, {})
        return {name: Registered(name, f"{seam}:{name}") for name in entries}

    def load(entry):
        seam, _, name = entry.target.partition(":")
        return names[seam][name]

    monkeypatch.setattr(Registered, "load", load)
    for module in (session_export, named_files):
        monkeypatch.setattr(module, "registered", known)
    # the command was made with the options of the extras that are here: made once more
    own = app.group("session")
    own.command()(session.info)
    own.command()(session.export)
    monkeypatch.setattr(session, "app", own)


@pytest.fixture
def run(tmp_path):
    return write_frames(tmp_path / "run.mcap", 3)


def test_they_stand_beside_our_own():
    assert set(export_formats()) == {*WRITERS, ".dust", ".fog"}
    assert export_formats()[".dust"] is DUST


def test_the_command_writes_them_with_their_options(tomoskin, run):
    out = run.with_name("x.dust")
    assert tomoskin("session", "export", run, out, "--colour", "red")[0] == 0
    assert out.read_text() == "run.mcap red"
    code, _, err = tomoskin("session", "export", run, run.with_name("x.csv"), "--colour", "red")
    assert (code, "--colour" in err) == (2, True)


def test_an_ending_that_nothing_writes_lists_them(tomoskin, run):
    code, _, err = tomoskin("session", "export", run, run.with_name("x.mud"))
    assert (code, ".dust (a cloud of dust)" in err) == (2, True)


def test_a_package_that_is_missing_is_named_before_the_work(tomoskin, run):
    code, _, err = tomoskin("session", "export", run, run.with_name("x.fog"))
    assert (code, "needs no_such_package" in err, install_hint("plot") in err) == (1, True, True)
