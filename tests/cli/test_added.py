"""Commands and options that come from elsewhere than the core."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Annotated

import pytest
import typer

from tomoskin.cli import app, main, named_files
from tomoskin.core import Registered


def shine(bright: Annotated[int, typer.Option(help="How bright.")] = 1) -> None:
    """Shine on the skin.

    More of it.
    """
    typer.echo(f"shines {bright}")


@dataclass(frozen=True)
class Glow:
    """An option that is added."""

    glow: Annotated[int, typer.Option(help="How much it glows.")] = 2


def plain(*, added: named_files.Added, last: Annotated[int, typer.Option()] = 3) -> None:
    """Show what came."""
    typer.echo(f"{[one.glow for one in added]} {last}")


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch):
    """A command, a sub-command and an option of a command, as a package registers them."""
    made = {
        "commands": {"shine": "shine", "skin shine": "shine", "plain": "plain"},
        "options": {"plain glow": "Glow", "skin show glow": "Glow"},
    }
    known = {
        seam: {name: Registered(name, f"{__name__}:{target}") for name, target in names.items()}
        for seam, names in made.items()
    }
    monkeypatch.setitem(sys.modules, __name__, SimpleNamespace(**globals()))
    for module in (app, named_files):
        monkeypatch.setattr(module, "registered", lambda seam: known[seam])
    monkeypatch.setattr(app, "registered_one", lambda seam, name: known[seam].get(name))


def run(capsys, *words: str) -> str:
    with pytest.raises(SystemExit) as end:
        main(words)
    out = capsys.readouterr()
    assert end.value.code in (0, None), out.err
    return out.out


def test_a_command_stands_in_the_list_with_its_first_sentence(capsys):
    assert "shine      Shine on the skin." in run(capsys, "--help")
    assert run(capsys, "shine", "--bright", "4") == "shines 4\n"
    assert "More of it." in run(capsys, "shine", "--help")


def test_a_sub_command_stands_beside_the_groups_own(capsys):
    listed = run(capsys, "skin", "--help")
    assert "Shine on the skin." in listed
    assert "list " in listed
    assert run(capsys, "skin", "shine") == "shines 1\n"


def test_options_are_added_where_a_command_takes_them(capsys):
    assert run(capsys, "plain", "--glow", "7") == "[7] 3\n"
    assert run(capsys, "plain", "--last", "9") == "[2] 9\n"
    assert "How much it glows." in run(capsys, "plain", "--help")
    assert "glow" not in run(capsys, "skin", "show", "--help")
