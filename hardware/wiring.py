"""The picture of a wired skin: sheet, clips, cable, board, seen from the front.

``python hardware/wiring.py`` writes it.
"""

from __future__ import annotations

import math
from pathlib import Path

FILE = Path(__file__).resolve().parent.parent / "docs" / "hardware" / "skin.svg"

CX, CY, RIM = 330, 350, 210
"""Of the sheet, in pixels; 200 mm across."""

CLIP = 24
"""How far a clip stands out."""

LEFT, FIRST, PITCH = 730, 172, 30
"""Terminals of the board: where they stand, the first, and one below the other."""

COLOURS = ("#8a5a2b", "#d62728", "#ef8a1d", "#e3c700", "#2a9d3a", "#1f6fd0", "#8e4fc0", "#8a8f98")
"""Brown, red, orange, … as in a ribbon cable, E1 first."""

_HEAD = """\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1040 700" width="1040" height="700">
<defs>
<pattern id="knit" width="9" height="9" patternUnits="userSpaceOnUse">
<rect width="9" height="9" fill="#c9cdd3"/>
<path d="M0.5 1 L4.5 6 L8.5 1" fill="none" stroke="#9aa1ab" stroke-width="1.7"/>
<path d="M0.5 5.5 L4.5 10 L8.5 5.5" fill="none" stroke="#e9ebee" stroke-width="1.2"/>
</pattern>
<radialGradient id="light" cx="0.38" cy="0.3" r="0.8">
<stop offset="0" stop-color="#fff" stop-opacity="0.45"/>
<stop offset="1" stop-color="#223" stop-opacity="0.22"/></radialGradient>
<linearGradient id="steel" x1="0" y1="0" x2="1" y2="1">
<stop offset="0" stop-color="#f7f8fa"/><stop offset="0.5" stop-color="#a9b0ba"/>
<stop offset="1" stop-color="#6d7580"/></linearGradient>
</defs>
<rect width="1040" height="700" rx="14" fill="#fbfbfa"/>
<g font-family="sans-serif" font-size="16" fill="#1d222b">
"""


def wiring() -> str:
    """The drawing as SVG."""
    parts = [*_sheet(), *_board()]
    for number in range(8):
        parts.append(_wire(number))
    for number in range(8):
        parts += _clip(number)
        parts += _terminal(number)
    return _HEAD + "\n".join([*parts, *_words()]) + "\n</g>\n</svg>\n"


def _at(number: int, radius: float) -> tuple[float, float]:
    """A point towards electrode ``number``: E1 at the top, then clockwise."""
    turn = math.radians(45 * number)
    return CX + radius * math.sin(turn), CY - radius * math.cos(turn)


def _sheet() -> list[str]:
    foam = f'<circle cx="{CX + 5}" cy="{CY + 7}" r="{RIM + 4}" fill="#e8dcae" stroke="#c2b27b"/>'
    knit = f'<circle cx="{CX}" cy="{CY}" r="{RIM}" fill="url(#knit)" stroke="#7d8590"/>'
    light = f'<circle cx="{CX}" cy="{CY}" r="{RIM}" fill="url(#light)"/>'
    axes = (
        f'<path d="M{CX} {CY} h62 m-9 -5 l9 5 l-9 5 M{CX} {CY} v-62 m-5 9 l5 -9 l5 9" fill="none" '
        'stroke="#1d222b" stroke-width="2.2"/>'
    )
    return [foam, knit, light, axes, _text(CX + 70, CY + 6, "x"), _text(CX - 5, CY - 72, "y")]


def _board() -> list[str]:
    """Board and Arduino, with what their plugs are for."""
    chips = [
        f'<rect x="{LEFT + 92}" y="{FIRST - 10 + PITCH * n}" width="34" height="20" rx="2" '
        'fill="#20242b"/>'
        for n in range(8)
    ]
    return [
        f'<rect x="{LEFT}" y="130" width="250" height="290" rx="8" fill="#1f6b45"/>',
        *chips,
        '<rect x="912" y="142" width="80" height="40" rx="4" fill="#20242b"/>',
        _text(952, 167, "12 V in", "middle", "#fff"),
        _text(915, 300, "board", "middle", "#fff"),
        _text(915, 322, "hardware/", "middle", "#cfe6d8"),
        f'<rect x="{LEFT}" y="450" width="250" height="120" rx="8" fill="#1c6f8c"/>',
        _text(746, 480, "Arduino Mega 2560", "start", "#fff"),
        '<rect x="960" y="486" width="44" height="46" rx="3" fill="url(#steel)" stroke="#555"/>',
        '<path d="M1004 509 h36" stroke="#20242b" stroke-width="9"/>',
        _text(944, 516, "USB", "end", "#fff"),
        *(
            f'<path d="M{x} 420 v30" stroke="#c9a227" stroke-width="5" stroke-dasharray="4 3"/>'
            for x in range(760, 960, 24)
        ),
    ]


def _wire(number: int) -> str:
    """From the clip around the sheet to the terminal; no two cross."""
    (x, y), end = _at(number, RIM + CLIP - 4), FIRST + PITCH * number
    to = f"{LEFT - 90} {end} {LEFT} {end}"
    if number == 0:
        way = f"M{x:.1f} {y:.1f} V{CY - 258} H{CX + 200} C{CX + 290} {CY - 258} {to}"
    elif number < 4:
        out = _at(number, RIM + 90)
        way = f"M{x:.1f} {y:.1f} C{out[0]:.1f} {out[1]:.1f} {to}"
    else:
        radius = 250 + 14 * (number - 4)
        first = _at(number, radius)
        arc = "" if number == 4 else f"A{radius} {radius} 0 0 0 {CX} {CY + radius} "
        way = f"M{x:.1f} {y:.1f} L{first[0]:.1f} {first[1]:.1f} {arc}H{CX + 150} "
        way += f"C{CX + 330} {CY + radius} {to}"
    halo = f'<path d="{way}" fill="none" stroke="#fbfbfa" stroke-width="8"/>'
    return halo + f'<path d="{way}" fill="none" stroke="{COLOURS[number]}" stroke-width="4.5"/>'


def _clip(number: int) -> list[str]:
    """A clip across the rim with its screw, and its name inside the sheet."""
    x, y = _at(number, RIM)
    inside = _at(number, RIM - 48)
    return [
        f'<g transform="rotate({45 * number} {x:.1f} {y:.1f})">'
        f'<rect x="{x - 11:.1f}" y="{y - CLIP:.1f}" width="22" height="{2 * CLIP}" rx="4" '
        'fill="url(#steel)" stroke="#4d545e"/>'
        f'<circle cx="{x:.1f}" cy="{y - 11:.1f}" r="6" fill="#d9dde2" stroke="#4d545e"/>'
        f'<path d="M{x - 4:.1f} {y - 11:.1f} h8" stroke="#4d545e" stroke-width="2"/></g>',
        f'<circle cx="{inside[0]:.1f}" cy="{inside[1]:.1f}" r="16" fill="#fbfbfa"/>',
        _text(inside[0], inside[1] + 6, f"E{number + 1}", "middle"),
    ]


def _terminal(number: int) -> list[str]:
    y = FIRST + PITCH * number
    return [
        f'<rect x="{LEFT - 4}" y="{y - 11}" width="34" height="22" rx="3" fill="#39a06b" '
        'stroke="#14482f"/>',
        f'<circle cx="{LEFT + 16}" cy="{y}" r="6" fill="url(#steel)"/>',
        _text(LEFT + 40, y + 6, f"E{number + 1}", "start", "#fff"),
    ]


def _words() -> list[str]:
    return [
        f'<rect x="{CX - 122}" y="{CY + 24}" width="244" height="52" rx="9" fill="#fbfbfa" '
        'fill-opacity="0.85"/>',
        _text(CX, CY + 44, "the front: this side is touched", "middle"),
        _text(CX, CY + 66, "disc of 200 mm, foam behind it", "middle"),
        _text(24, 34, "E1 at the top, then clockwise, seen from the front", "start"),
        _text(24, 58, "clip: 10 mm of the rim", "start"),
        _text(855, 112, "terminals E1 to E8: one wire each", "middle"),
        _text(855, 604, "to the computer: tomoskin live --source serial:auto", "middle"),
    ]


def _text(x: float, y: float, words: str, anchor: str = "start", fill: str = "#1d222b") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{fill}">{words}</text>'


if __name__ == "__main__":
    FILE.write_text(wiring(), encoding="utf-8")
