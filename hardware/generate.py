"""Writes netlists, bills of materials and drawings; ``--check`` fails when they are stale."""

from __future__ import annotations

import sys
from pathlib import Path

from schematic.board import assembly
from schematic.pages import drawings

ROOT = Path(__file__).resolve().parent


def files() -> dict[Path, str]:
    """Each file with its text; ValueError when a rule check finds something."""
    made: dict[Path, str] = {}
    for channels in (8, 16):
        circuit = assembly(channels)
        if problems := circuit.problems():
            raise ValueError(f"{channels} channels: " + "; ".join(problems))
        made[ROOT / f"board-{channels}.net"] = circuit.netlist()
        made[ROOT / f"board-{channels}.csv"] = circuit.bill()
    for name, svg in drawings().items():
        made[ROOT.parent / "docs" / "hardware" / f"{name}.svg"] = svg
    return made


def stale() -> list[str]:
    """Names of the files that are not what they should be."""
    return [
        file.name
        for file, text in files().items()
        if not file.is_file() or file.read_text(encoding="utf-8") != text
    ]


def main() -> int:
    """Write the files, or say which are stale."""
    if sys.argv[1:] == ["--check"]:
        old = stale()
        print(*old, sep="\n", end="\n" if old else "", file=sys.stderr)
        return bool(old)
    for file, text in files().items():
        file.parent.mkdir(exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
