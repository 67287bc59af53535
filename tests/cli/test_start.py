"""What the command line waits for before it knows its command."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest

from tomoskin.cli.app import COMMANDS

HEAVY = ("numpy", "scipy", "rich", "msgspec", "starlette", "tomoskin.model.forward")
LIGHT = {"app", "named_files"}
"""Modules of the command line that are there before a command is known."""

SHARED = {"choices", "named_parts", "options", "output"}
"""What commands of extras are made of, which are loaded for their sentences."""

MOST_MODULES = 60
"""That `import tomoskin` may load; numpy alone is some 150."""


def _said(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_help_loads_nothing_heavy() -> None:
    """Numbers, pictures and servers are loaded by the command that needs them."""
    show = f"print([m for m in {HEAVY} if m in sys.modules])"
    assert _said(f"import sys, tomoskin.cli.app; {show}") == "[]"


def test_help_loads_no_command() -> None:
    code = (
        "import sys, contextlib, io, tomoskin.cli\n"
        "with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()):\n"
        "    tomoskin.cli.main(['--help'])\n"
        "print(*(m.removeprefix('tomoskin.cli.') for m in sys.modules if 'tomoskin.cli.' in m))"
    )
    assert LIGHT <= set(_said(code).split()) <= LIGHT | SHARED


def test_the_package_is_a_command_too() -> None:
    """Where a shell does not find the command by its name."""
    done = subprocess.run(
        [sys.executable, "-m", "tomoskin", "skin", "list"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "textile-disc-8" in done.stdout


def test_importing_the_package_loads_next_to_nothing() -> None:
    """A count, since a time says more of the machine: rooms are loaded when they are used."""
    code = (
        "import sys; before = set(sys.modules); import tomoskin; print(*set(sys.modules) - before)"
    )
    loaded = _said(code).split()
    assert len(loaded) <= MOST_MODULES
    assert [name for name in loaded if name.startswith("tomoskin.")] == []


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_where_its_name_says(tomoskin, name) -> None:
    code, out, err = tomoskin(name, "--help")
    assert (code, err) == (0, "")
    assert out.startswith(f"Usage: tomoskin {name} ")
    assert "--install-completion" not in out


@pytest.mark.parametrize("words", [(), ("calibrate",), ("session",), ("skin",), ("firmware",)])
def test_every_command_says_what_it_does_in_whole_sentences(tomoskin, words) -> None:
    code, out, _ = tomoskin(*words, "--help")
    listed = out.partition("Commands:")[2]
    sentences = re.sub(r"\n {4,}", " ", listed).strip().splitlines()
    assert code == 0
    assert len(sentences) >= 3
    assert [line for line in sentences if not re.match(r" *[a-z]+  +[A-Z].+[.)]$", line)] == []
    assert "..." not in listed


def test_a_command_that_is_nearly_one_is_named(tomoskin) -> None:
    code, _, err = tomoskin("imge")
    assert code == 2
    assert "'image'" in err


@pytest.mark.parametrize(
    "words",
    [
        ("firmware", "build", "--board", "mgea"),
        ("record", "run.mcap", "--source", "twin:mgea"),
        ("record", "run.mcap", "--source", "twin:board=mgea"),
    ],
)
def test_a_board_that_is_nearly_one_is_named(tomoskin, words, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    code, _, err = tomoskin(*words)
    assert code
    assert 'did you mean "mega"?' in " ".join(err.replace("│", " ").split())


@pytest.mark.parametrize(
    ("board", "channels", "said"),
    [
        ("mega", 7, "expected 8 or 16 channels (Arduino Mega 2560), got 7"),
        ("mega", 32, "got 32; a Raspberry Pi Pico has them: --board pico"),
        ("pico", 64, "expected 8, 16 or 32 channels (Raspberry Pi Pico), got 64"),
    ],
)
def test_firmware_is_of_the_channels_that_a_board_has(tomoskin, board, channels, said) -> None:
    code, _, err = tomoskin("firmware", "build", "--board", board, "--channels", str(channels))
    assert code == 2
    assert said in " ".join(err.replace("│", " ").split())
