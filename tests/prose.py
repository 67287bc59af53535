"""Prose of the documentation and of commands, sentence by sentence."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from typer.main import get_command

from tomoskin.cli.app import app

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = (
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")),
    *sorted(DOCS.rglob("*.md")),
)

_FENCE = re.compile(r"^(```|:::|\$\$).*?^\1\s*$", re.DOTALL | re.MULTILINE)
_COMMENT = re.compile(r"<!--.*?-->|^\[[^\]]+\]: .*$", re.DOTALL | re.MULTILINE)
_ENDS = re.compile(r"(?<=[.!?:;])[)*\"”]*\s+(?=[A-Z`*\[(])")
_LINK = re.compile(r"!?\[([^\]]*)\](?:\([^)]*\)|\[[^\]]*\])")
_CODE = re.compile(r"`[^`]+`|\$[^$]+\$")
_WORD = re.compile(r"[A-Za-zÀ-ž][\w’'-]*")


@dataclass(frozen=True)
class Sentence:
    """One sentence, and the page or command that it stands in; ``words`` without code."""

    where: str
    text: str

    @property
    def words(self) -> list[str]:
        """Its words; code counts as none."""
        return _WORD.findall(_CODE.sub(" ", self.text))


def sentences(page: Path) -> Iterator[Sentence]:
    """Sentences of a page's paragraphs, lists and tables; a cell of a table is one at least."""
    text = _COMMENT.sub("", _FENCE.sub("\n\n", page.read_text(encoding="utf-8")))
    for block in re.split(r"\n\s*\n|\n(?=\s*(?:[-*|#>]|\d+\.) )|\|", text):
        yield from sentences_of(block, page.relative_to(ROOT).as_posix())


def sentences_of(block: str, where: str) -> Iterator[Sentence]:
    """Sentences of one paragraph."""
    flat = _LINK.sub(r"\1", " ".join(block.split()))
    for part in _ENDS.split(flat):
        if part.strip():
            yield Sentence(where, part.strip())


def helps() -> Iterator[tuple[str, str]]:
    """Each command by its words, and each option, with its help."""
    yield from _helps("tomoskin", get_command(app))


def _helps(name: str, command: Any) -> Iterator[tuple[str, str]]:
    for block in (command.help or "").split("\n\n"):
        yield name, block
    for parameter in command.params:
        yield f"{name} {parameter.opts[0]}", getattr(parameter, "help", None) or ""
    for below in command.list_commands(None) if hasattr(command, "list_commands") else ():
        yield from _helps(f"{name} {below}", command.get_command(None, below))
