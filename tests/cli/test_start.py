"""What the command line waits for before it knows its command."""

from __future__ import annotations

import subprocess
import sys

HEAVY = ("numpy", "scipy", "rich", "msgspec", "starlette", "tomoskin.forward")


def test_help_loads_nothing_heavy() -> None:
    """Numbers, pictures and servers are loaded by the command that needs them."""
    code = f"import sys, tomoskin.cli.app; print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_every_command_says_what_it_does(tomoskin) -> None:
    code, out, _ = tomoskin("--help")
    commands = out.partition("Commands:")[2].strip().splitlines()
    assert code == 0
    assert len(commands) > 10
    assert all(len(line.split()) > 3 for line in commands)
