"""What a key and a section of the skin file are."""

from __future__ import annotations

from dataclasses import dataclass

from tomoskin.skin.kinds import Kind

FORMAT = 1
"""Version of the file that this code reads, the top-level key ``format``."""

Raw = str | int | float
"""A default as it would stand in the file."""


@dataclass(frozen=True)
class Key:
    """One key of a section.

    Attributes
    ----------
    kind
        What its value may be.
    meaning
        A sentence for the documentation.
    default
        Value when the key is absent; None where there is none.
    required
        The key must be there (where ``when`` and ``unless`` let it stand at all).
    when
        Another key of the section and the values of it for which this one may stand.
    unless
        Another key of the section that takes this one's place.
    needs
        Another key of the section that must stand beside this one.
    """

    name: str
    kind: Kind
    meaning: str
    default: Raw | None = None
    required: bool = False
    when: tuple[str, tuple[str, ...]] | None = None
    unless: str = ""
    needs: str = ""


@dataclass(frozen=True)
class Section:
    """A table of the file; with ``many``, a list of tables."""

    name: str
    meaning: str
    keys: tuple[Key, ...]
    many: bool = False

    @property
    def heading(self) -> str:
        """The line that begins it."""
        return f"[[{self.name}]]" if self.many else f"[{self.name}]"
