"""Quantities with units, as people write them in a skin file: ``"200 mm"``, ``"0.8 ohm/sq"``."""

from __future__ import annotations

import math
import re

_PREFIX = {"u": 1e-6, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}


def _scaled(symbol: str, prefixes: str) -> dict[str, float]:
    return {f"{p}{symbol}": _PREFIX[p] for p in [*prefixes, ""]}


DIMENSIONS: dict[str, dict[str, float]] = {
    "length": _scaled("m", "muµ") | {"cm": 1e-2},
    "current": _scaled("A", "muµ"),
    "voltage": _scaled("V", "muµ"),
    "time": _scaled("s", "muµ"),
    "angle": {"deg": math.pi / 180, "rad": 1.0},
    "sheet resistance": {"ohm/sq": 1.0, "Ω/sq": 1.0, "kohm/sq": 1e3, "kΩ/sq": 1e3, "mohm/sq": 1e-3},
    "resistivity": {"ohm*m": 1.0, "Ω·m": 1.0, "ohm*cm": 1e-2, "Ω·cm": 1e-2, "mohm*m": 1e-3},
    "force": _scaled("N", "mk"),
    "frequency": _scaled("Hz", "kM"),
    "resistance": {"ohm": 1.0, "Ω": 1.0, "kohm": 1e3, "kΩ": 1e3, "mohm": 1e-3, "Mohm": 1e6},
    "ratio": {"": 1.0, "%": 1e-2},
}
"""For each dimension the accepted unit symbols and their size in SI."""

_QUANTITY = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*$")
_COMMA = re.compile(r"(?<=\d),(?=\d)")


def parse_quantity(text: str, dimension: str) -> float:
    """Return ``text`` in SI units.

    Raises
    ------
    ValueError
        When there is no finite number, or the unit is not one of ``DIMENSIONS[dimension]``;
        the message names the units that would do.
    """
    units = DIMENSIONS[dimension]
    choices = ", ".join(u or "no unit" for u in units)
    match = _QUANTITY.match(text)
    if not match:
        hint = ""
        if _COMMA.search(text) and _QUANTITY.match(pointed := _COMMA.sub(".", text)):
            hint = f'; with a decimal point: "{pointed.strip()}"'
        raise ValueError(
            f'expected a number with a unit of {dimension} ({choices}), got "{text}"{hint}'
        )
    number, unit = match.groups()
    unit = unit.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    if unit not in units:
        got = f'unit "{unit}"' if unit else "no unit"
        raise ValueError(f"expected a unit of {dimension} ({choices}), got {got}")
    if not math.isfinite(float(number)):
        raise ValueError(f'expected a finite number, got "{text}"')
    return float(number) * units[unit]
