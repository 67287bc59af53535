"""A skin's sections → text of a skin file."""

from __future__ import annotations

from tomoskin.skin.kinds import literal
from tomoskin.skin.read import Document
from tomoskin.skin.schema import FORMAT, SECTIONS


def toml(document: Document) -> str:
    """Skin file of ``document``, in the schema's order."""
    lines = [f"format = {FORMAT}"]
    for section in SECTIONS:
        keys = document[section.name]
        lines += ["", f"[{section.name}]"]
        lines += [f"{k.name} = {literal(keys[k.name])}" for k in section.keys if k.name in keys]
    return "\n".join(lines) + "\n"
