"""The skin file, declared once: reading, errors, writing and its documentation follow."""

from tomoskin.skin.schema.board import BOARD
from tomoskin.skin.schema.entry import FORMAT, Key, Section
from tomoskin.skin.schema.picture import PICTURE
from tomoskin.skin.schema.sheet import SHEET

SECTIONS: tuple[Section, ...] = SHEET + BOARD + PICTURE
"""Every section and key, in the order in which they are written."""

__all__ = ["FORMAT", "SECTIONS", "Key", "Section"]
