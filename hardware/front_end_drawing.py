"""Draws the Pico's front end: front_end_circuit.toml as docs/images/front-end.svg.

Wires are names: pins with the same name beside them are connected.
"""

from __future__ import annotations

import tomllib
from html import escape
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
CIRCUIT = HERE / "front_end_circuit.toml"
DRAWING = HERE.parent / "docs" / "images" / "front-end.svg"

WIDTH, PITCH, BOX, STUB = 262, 15, 100, 14
"""Px: a column, a pin, the width of a box, a pin's line."""

ROWS = (30, 340, 480)
"""Px from the top to each row of boxes."""

POLES = (600, 7, 218)
"""Px from the top to the resistors and capacitors, how many stand in a row, and px for each."""

SIZE = (6 * WIDTH + 20, 800)
COLOURS = {"GND": "#555", "+5V": "#b00", "-5V": "#06a", "+3V3": "#b60", "+3V3A": "#b60"}

Nets = dict[str, list[tuple[str, str]]]


def read() -> dict[str, Any]:
    """The parts, as the file has them."""
    return tomllib.loads(CIRCUIT.read_text(encoding="utf-8"))


def pins(part: dict[str, Any]) -> dict[str, str]:
    """Net of each pin, of a box or of a part with two poles."""
    if "nets" in part:
        return dict(zip("12", part["nets"], strict=True))
    left, right = part["left"], part["right"]
    return {name: net for side in (left, right) for name, net in side.items()}


def parts() -> dict[str, dict[str, Any]]:
    """All parts by their reference."""
    table = read()
    poles: dict[str, dict[str, Any]] = table.pop("two_poles")
    return table | poles


def nets() -> Nets:
    """Reference and pin of all that is on each net."""
    found: Nets = {}
    for reference, part in parts().items():
        for pin, net in pins(part).items():
            found.setdefault(net, []).append((reference, pin))
    return found


def drawn() -> str:
    """The drawing, an SVG."""
    table = read()
    poles = table.pop("two_poles")
    width, height = SIZE
    body = [box(reference, part) for reference, part in table.items()]
    body += [pole(number, *item) for number, item in enumerate(poles.items())]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" font-size="11">\n'
        f'<rect width="{width}" height="{height}" fill="white"/>\n' + "\n".join(body) + "\n</svg>\n"
    )


def box(reference: str, part: dict[str, Any]) -> str:
    """A part with its pins to the left and right."""
    column, row = part["at"]
    x, y = 80 + column * WIDTH, ROWS[row]
    high = PITCH * max(len(part["left"]), len(part["right"])) + 6
    lines = [
        f'<rect x="{x}" y="{y}" width="{BOX}" height="{high}" fill="#fffbe8" stroke="#333"/>',
        text(x + BOX / 2, y - 6, f"{reference} {part['part']}", "middle", "#000", bold=True),
    ]
    for side, names in (("left", part["left"]), ("right", part["right"])):
        for number, (pin, net) in enumerate(names.items()):
            lines.append(lead(x, y + PITCH * number + 14, pin, net, left=side == "left"))
    return "\n".join(lines)


def lead(x: float, y: float, pin: str, net: str, *, left: bool) -> str:
    """A pin of a box at ``x``: its name inside, its net outside."""
    edge, out = (x, -1) if left else (x + BOX, 1)
    inside, outside = ("start", "end") if left else ("end", "start")
    return (
        f'<path d="M{edge} {y - 4}h{out * STUB}" stroke="#333"/>'
        + text(edge - 4 * out, y, pin, inside, "#333")
        + text(edge + out * (STUB + 3), y, net, outside, COLOURS.get(net, "#060"))
    )


def pole(number: int, reference: str, part: dict[str, Any]) -> str:
    """A resistor or capacitor between the names of its two nets."""
    top, across, step = POLES
    x, y = 76 + number % across * step, top + number // across * 44
    body = (
        '<rect x="{0}" y="{1}" width="36" height="10" fill="#fffbe8" stroke="#333"/>'
        '<path d="M{2} {3}h12M{4} {3}h12" stroke="#333"/>'
        if reference[0] == "R"
        else '<path d="M{5} {6}v16M{7} {6}v16M{2} {3}h27M{7} {3}h27" stroke="#333" fill="none"/>'
    ).format(x + 12, y - 5, x, y, x + 48, x + 27, y - 8, x + 33)
    one, other = part["nets"]
    return (
        body
        + text(x + 30, y - 12, f"{reference} {part['value']}", "middle", "#000")
        + text(x - 3, y + 4, one, "end", COLOURS.get(one, "#060"))
        + text(x + 63, y + 4, other, "start", COLOURS.get(other, "#060"))
    )


def text(x: float, y: float, words: str, anchor: str, colour: str, *, bold: bool = False) -> str:
    """Words of the drawing."""
    weight = ' font-weight="bold"' if bold else ""
    return (
        f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}" fill="{colour}"{weight}>'
        f"{escape(words)}</text>"
    )


if __name__ == "__main__":
    DRAWING.write_text(drawn(), encoding="utf-8")
