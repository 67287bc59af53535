"""The bill of materials: of the schematic's parts, what they cost one by one and in numbers."""

from __future__ import annotations

import csv
import io
import tomllib
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

from netlist import Part

PRICES = Path(__file__).resolve().parent / "prices.toml"
BOARDS = (1, 10, 100)
COLUMNS = [
    "Comment",
    "Designator",
    "Footprint",
    "Manufacturer",
    "MPN",
    "Mouser",
    "Quantity",
    "EUR each",
]


class BillError(Exception):
    """A part that cannot be ordered, or has no price."""


def prices() -> dict[str, list[float]]:
    """Euros for one of each part, by its number, when parts for 1, 10 and 100 boards are bought."""
    table: dict[str, list[float]] = tomllib.loads(PRICES.read_text(encoding="utf-8"))["part"]
    return table


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
    if unknown := sorted(set(groups) - set(prices())):
        raise BillError(f"{PRICES.name}: expected a price for each part, none for {unknown}")
    return dict(groups)


def total(parts: Mapping[str, Part], boards: int) -> float:
    """Euros for the parts of one board, when as many are bought."""
    column, each = BOARDS.index(boards), prices()
    return sum(len(group) * each[number][column] for number, group in grouped(parts).items())


def bill(parts: Mapping[str, Part]) -> str:
    """The bill as CSV, in the columns that assembly houses read."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    each = prices()
    for number, group in grouped(parts).items():
        first, names = group[0], ",".join(part.reference for part in group)
        fields = [first.fields[field] for field in ("Manufacturer", "MPN", "Mouser")]
        rows.writerow([first.value, names, first.footprint, *fields, len(group), each[number][0]])
    return text.getvalue()
