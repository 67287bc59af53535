"""What tomoskin says to people: texts of errors, hints, events and settings, from the source."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from prose import ROOT

SOURCES = ROOT / "src" / "tomoskin"
HOLE = "…"
"""Stands for a value in an f-string."""

LEAST = 3
"""Words of a text that is read as prose; shorter ones are names and keys."""


def messages(least: int = LEAST) -> Iterator[tuple[str, str]]:
    """Each text of ``least`` words with its file and line; docstrings are not among them."""
    for path in sorted(SOURCES.rglob("*.py")):
        name = path.relative_to(SOURCES).as_posix()
        for line, text in messages_in(path.read_text(encoding="utf-8"), least):
            yield f"{name}:{line}", text


def messages_in(source: str, least: int = LEAST) -> Iterator[tuple[int, str]]:
    """Texts of ``least`` words in Python ``source``, with their lines."""
    tree = ast.parse(source)
    docstrings = {id(n.value) for n in ast.walk(tree) if isinstance(n, ast.Expr)}
    for line, text in _texts(tree, docstrings):
        if len(text.split()) >= least:
            yield line, text


def _texts(node: ast.AST, docstrings: set[int]) -> Iterator[tuple[int, str]]:
    if id(node) in docstrings and isinstance(node, ast.Constant):
        return
    if isinstance(node, ast.JoinedStr):
        parts = (p.value if isinstance(p, ast.Constant) else HOLE for p in node.values)
        yield node.lineno, "".join(map(str, parts))
    if isinstance(node, ast.Constant):
        if isinstance(node.value, str):
            yield node.lineno, node.value
        return
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.JoinedStr) and isinstance(child, ast.Constant)):
            yield from _texts(child, docstrings)
