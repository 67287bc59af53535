"""The bill of materials: of the schematic's parts, where they are sold and what they cost."""

from __future__ import annotations

import csv
import io
import tomllib
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from netlist import Part

PARTS = Path(__file__).resolve().parent / "parts.toml"
BOARDS = (1, 10, 100)
COLUMNS = [
    "Comment",
    "Designator",
    "Footprint",
    "Manufacturer",
    "MPN",
    "Mouser",
    "Second distributor",
    "Alternative",
    "State",
    "Quantity",
    "EUR each",
    "EUR each of 10 boards",
    "EUR each of 100 boards",
]


class BillError(Exception):
    """A part that cannot be ordered, or of which nothing is known."""


@dataclass(frozen=True)
class Bought:
    """What is known of a part: a second distributor's number and another part that fits, each where
    there is one, its life cycle's state, and euros for one when parts for 1, 10 and 100 boards are
    bought."""

    second: str
    other: str
    state: str
    each: tuple[float, float, float]


def known() -> dict[str, Bought]:
    """What is known of each part, by its number."""
    table = tomllib.loads(PARTS.read_text(encoding="utf-8"))["part"]
    return {
        name: Bought(row["second"], row.get("other", ""), row["state"], tuple(row["each"]))
        for name, row in table.items()
    }


def grouped(parts: Mapping[str, Part]) -> dict[str, list[Part]]:
    """Parts to order by their manufacturer's number; BillError where one lacks it."""
    groups: dict[str, list[Part]] = defaultdict(list)
    for part in parts.values():
        if not part.in_bom:
            continue
        for field in ("Manufacturer", "MPN", "Mouser"):
            if not part.fields.get(field):
                raise BillError(
                    f"{part.reference} ({part.value}): expected a field {field} in the schematic"
                )
        groups[part.fields["MPN"]].append(part)
    if unknown := sorted(set(groups) - set(known())):
        raise BillError(f"{PARTS.name}: expected each part with its price, none for {unknown}")
    return dict(groups)


def total(parts: Mapping[str, Part], boards: int) -> float:
    """Euros for the parts of one board, when as many are bought."""
    column, parts_known = BOARDS.index(boards), known()
    return sum(
        len(group) * parts_known[number].each[column] for number, group in grouped(parts).items()
    )


def bill(parts: Mapping[str, Part]) -> str:
    """The bill as CSV, in the columns that assembly houses read."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    about = known()
    for number, group in grouped(parts).items():
        first, names = group[0], ",".join(part.reference for part in group)
        fields = [first.fields[field] for field in ("Manufacturer", "MPN", "Mouser")]
        one = about[number]
        tail = (one.second, one.other, one.state, len(group), *one.each)
        rows.writerow([first.value, names, first.footprint, *fields, *tail])
    return text.getvalue()
