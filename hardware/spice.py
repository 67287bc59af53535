"""Runs the decks under ngspice and reads what they say."""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections import defaultdict
from pathlib import Path

DECKS = Path(__file__).resolve().parent / "decks"
_SAID = re.compile(r"^@ (\w+) (\S+)$", re.MULTILINE)
_PATIENCE = 60
_ERROR = re.compile(r"(?i)error(?!: measure|: &)|.*(timestep too small|aborted)")
_PLACE = re.compile(r"@(\w+)@")


class DeckError(Exception):
    """A deck that cannot be run, or that says nothing."""


def run(deck: str, **values: object) -> dict[str, list[float]]:
    """What ``decks/<deck>.cir`` says, name by name, in its order.

    Each ``@name@`` in it becomes ``values[name]``. What it says are lines "@ name number"; what
    never happened (a crossing that there was none of) is left out.

    Raises
    ------
    DeckError
        Without a value for a place, for one without a place, or when ngspice fails or hangs.
    """
    text = (DECKS / f"{deck}.cir").read_text(encoding="utf-8")
    places = set(_PLACE.findall(text))
    if places != set(values):
        raise DeckError(f"{deck}: expected values for {sorted(places)}, got {sorted(values)}")
    text = _PLACE.sub(lambda place: str(values[place[1]]), text)
    with tempfile.NamedTemporaryFile("w", suffix=".cir") as file:
        file.write(re.sub(r"(?m)^\.include (.*)$", rf'.include "{DECKS}/\1"', text))
        file.flush()
        command = ["ngspice", "-b", file.name]
        try:
            done = subprocess.run(
                command, capture_output=True, text=True, check=False, timeout=_PATIENCE
            )
        except subprocess.TimeoutExpired as error:
            raise DeckError(f"{deck}: nothing after {_PATIENCE} s") from error
    said: dict[str, list[float]] = defaultdict(list)
    for name, value in _SAID.findall(done.stdout):
        said[name].append(float(value))
    wrong = [line for line in done.stderr.splitlines() if _ERROR.match(line)]
    if not said or wrong:
        raise DeckError(f"{deck}: {wrong or done.stderr[-2000:] or done.stdout[-2000:]}")
    return dict(said)
