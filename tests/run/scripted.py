"""Scripts run on the twin of one skin, into a session file."""

from __future__ import annotations

from pathlib import Path

from tomoskin.model.skin import Skin
from tomoskin.run import simulate
from tomoskin.run.scripted import Simulated
from tomoskin.twin import Script

SKIN = Skin.load("textile-disc-8")
FRAME = 56e-3
"""Seconds that a frame of it takes, about."""

PRESS = """[[press]]
id = "a"
radius = "15 mm"
at = ["20 mm", "-30 mm"]
start = "200 ms"
force = "3 N"
hold = "300 ms"
"""


def run(out: Path, lead_in: str, *happens: str, advance=lambda _, __: None) -> Simulated:
    """A second of the skin after ``lead_in``."""
    head = f'format = 1\n[script]\nduration = "1 s"\nlead_in = "{lead_in}"\n'
    return simulate(Script.from_toml(head + "".join(happens)), SKIN, out, advance=advance)


def fault(kind: str, start: str, end: str = "", **keys: object) -> str:
    """A fault of a script."""
    lines = [f'kind = "{kind}"', f'start = "{start}"', *([f'end = "{end}"'] if end else [])]
    return "\n".join(
        ["[[fault]]", *lines, *(f"{key} = {value}" for key, value in keys.items()), ""]
    )
