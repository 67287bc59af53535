"""The same sheet with other electrodes and patterns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from tomoskin.core import TomoskinError
from tomoskin.skin import Skin

_MM = 1e3


@dataclass(frozen=True, eq=False)
class Variant:
    """A skin with another number of electrodes or another pattern, or why there is none."""

    electrodes: int
    pattern: str
    skin: Skin | None
    fault: str = ""


def variants(skin: Skin, electrodes: Sequence[int], patterns: Sequence[str]) -> Iterator[Variant]:
    """Every combination, on the same sheet with the same read-out and current.

    Electrodes are spread evenly and cover together as much of the rim as those of ``skin``.
    """
    cover = skin.n_electrodes * _width(skin)
    evenly = {"first": "90 deg", "order": "clockwise"}
    kept = {key: skin.document["electrodes"].get(key, word) for key, word in evenly.items()}
    for count in electrodes:
        layout = kept | {
            "count": count,
            "positions": None,
            "width": f"{_MM * cover / count:.6g} mm",
            "contact_impedance": f"{float(skin.contact_impedance.mean()):.9g} ohm*m",
        }
        for pattern in patterns:
            drive = {"pattern": pattern, "drive": None, "measure": None}
            try:
                yield Variant(count, pattern, skin.altered({"electrodes": layout, "drive": drive}))
            except TomoskinError as error:
                yield Variant(count, pattern, None, error.message)


def _width(skin: Skin) -> float:
    return float(skin.arcs[0].width(skin.outline))
