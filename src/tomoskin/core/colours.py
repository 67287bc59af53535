"""The colours of pictures, from colours.json, which the page is built with too.

A fall of conductivity is blue, a rise red, none neutral. What has no sign goes from pale to dark
green, which nobody takes for either.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tomoskin.core.errors import DataError
from tomoskin.core.extras import install_hint

if TYPE_CHECKING:
    from matplotlib.colors import ListedColormap

SIZE = 511
"""Colours of a table; odd, so that no change has one of its own."""


@dataclass(frozen=True)
class ColourScale:
    """A scale of colours: ``stops``, #rrggbb, at even distances from its low to its high end."""

    name: str
    stops: tuple[str, ...]

    @cached_property
    def table(self) -> NDArray[np.uint8]:
        """(511, 3) sRGB levels from the low end to the high one, linear between the stops."""
        levels = np.array([[*bytes.fromhex(stop[1:])] for stop in self.stops])
        at = np.linspace(0, len(levels) - 1, SIZE)
        channels = [np.interp(at, np.arange(len(levels)), channel) for channel in levels.T]
        return np.floor(np.transpose(channels) + 0.5).astype(np.uint8)

    def colormap(self) -> ListedColormap:
        """The scale for matplotlib; raises DataError when that is not installed."""
        try:
            from matplotlib.colors import ListedColormap
        except ImportError as error:
            raise DataError("colour maps need matplotlib", hint=install_hint("plot")) from error
        return ListedColormap(self.table / 255, self.name)


_DATA = json.loads(files(__package__).joinpath("colours.json").read_text(encoding="utf-8"))

CHANGE = ColourScale("change", tuple(_DATA["change"]["light"]))
"""Of a change, from the greatest fall (blue) to the greatest rise (red), on a light ground."""

CHANGE_ON_DARK = ColourScale("change on dark", tuple(_DATA["change"]["dark"]))
"""The same on a dark ground."""

AMOUNT = ColourScale("amount", tuple(_DATA["amount"]))
"""Of what has no sign, from the least (pale) to the most (dark)."""
