"""Where each part stands: board coordinates, mm, origin at the top left corner; rotation, degrees.

The Arduino Mega 2560 lies under the lower edge, its left edge 11 mm left of the board's, so that
its USB and power sockets stay free. Channels are equal tiles of 11.2 mm along the upper edge.
"""

from __future__ import annotations

from dataclasses import dataclass

Place = tuple[float, float, float]

HEIGHT, TILE, MARGIN = 99.5, 11.2, 0.5
MEGA_LEFT = 11.0
STEP = 62.0
"""Lower edge of the part of a long board that stands beyond the Mega."""


@dataclass(frozen=True)
class Rail:
    """A supply or bus along all channels, on the inner layer."""

    net: str
    y: float
    width: float


TILES: dict[str, Place] = {
    "J1": (8.1, 5.7, 180), "D1": (7.3, 14, 180), "Q2": (2.4, 18, 90), "Q3": (8.6, 18, 90),
    "R3": (1.9, 21.4, 0), "R4": (5.6, 21.4, 0), "R5": (9.2, 21.4, 0),
    "Q1": (2.4, 24.6, 90), "R1": (6.4, 23.6, 0), "R2": (6.4, 25.4, 180),
    "R7": (1.85, 30, 0), "C2": (1.85, 31.7, 180), "C1": (1.85, 33.4, 180), "R6": (1.85, 35.1, 0),
    "U1": (7.2, 32.3, 0), "R8": (5.7, 28.6, 0), "C5": (9.3, 28.6, 0),
    "C6": (5.2, 36.2, 180), "R9": (8.9, 36.2, 180), "C3": (8.9, 37.9, 0), "R10": (5.6, 37.9, 180),
    "D2": (2.4, 39.6, 0), "U2": (8.4, 41.3, 0), "C7": (5.2, 43.9, 0),
    "R11": (8.7, 44.1, 180), "C4": (1.9, 43.9, 180),
}  # fmt: skip
"""One channel, in its tile."""

RAILS = (
    Rail("BUS", 19.6, 1.5), Rail("+12V", 22.9, 0.8), Rail("+12V", 27.2, 0.8),
    Rail("MINUS", 29.9, 0.4), Rail("MIDDLE", 34.5, 0.4), Rail("-5V", 37.1, 0.8),
    Rail("+5V", 40.6, 0.8),
)  # fmt: skip

LINK = ("+12V", 22.9, 27.2)
"""Joins the two rails of one net at their left ends."""

COMMON: dict[str, Place] = {
    "J1": (13.9, 72.0, 270), "F1": (19.2, 70.0, 0), "D1": (25.4, 70.0, 180), "C1": (19.2, 72.8, 0),
    "TP1": (24.4, 75.6, 0), "TP4": (29.4, 75.6, 0), "TP5": (49.5, 58.2, 0),
    "U1": (21.5, 81.0, 0), "C2": (27.8, 81.0, 90), "C3": (21.5, 86.0, 0), "TP2": (15.6, 87.4, 0),
    "C5": (29.0, 92.0, 0), "TP6": (33.4, 92.4, 0),
    "R1": (37.0, 82.0, 0), "U2": (37.2, 85.4, 0), "U3": (42.4, 85.4, 0), "C4": (42.6, 82.2, 0),
    "TP3": (48.0, 86.2, 0),
    "Q21": (9.2, 62.0, 180), "R23": (18.9, 58.3, 0), "R24": (18.8, 60.3, 0), "R25": (18.8, 62.1, 0),
    "R22": (18.8, 63.9, 0), "R26": (18.8, 65.7, 0), "C21": (23.6, 65.4, 0),
    "U22": (24.0, 62.2, 180),
    "U21": (24.4, 57.8, 0), "R21": (28.6, 56.8, 0), "C22": (28.4, 61.0, 90),
    "TP21": (16.2, 55.6, 0), "TP22": (10.6, 56.0, 0),
    "R27": (11.6, 50.6, 0), "Q22": (17.2, 50.4, 0), "R28": (21.4, 49.4, 0),
    "R29": (21.4, 51.2, 0), "D21": (21.8, 53.6, 180),
    "U23": (26.4, 50.9, 0), "C23": (26.4, 53.8, 0),
    "U41": (43.0, 69.0, 90), "C41": (53.0, 71.0, 90), "J41": (58.2, 72.3, 90),
    "J42": (58.2, 79.0, 90),
    "TP41": (72.4, 73.2, 0), "TP42": (72.4, 79.2, 0),
    "J61": (16.94, 96.96, 0), "J62": (39.8, 96.96, 0), "J63": (62.66, 96.96, 0),
    "J64": (82.98, 91.88, 0),
    "U81": (37.0, 52.6, 90), "C81": (37.0, 57.6, 0), "U82": (62.0, 52.6, 90),
    "C82": (62.0, 57.6, 0),
    "U91": (110.0, 52.6, 90), "C91": (110.0, 57.6, 0), "U92": (132.0, 52.6, 90),
    "C92": (132.0, 57.6, 0),
    "H1": (4.24, 48.7, 0), "H2": (2.97, 96.96, 0), "H3": (55.04, 63.94, 0),
    "H4": (55.04, 91.88, 0), "H5": (85.52, 96.96, 0),
    "H6": (175.5, 58.0, 0), "H7": (96.5, 55.0, 0),
}  # fmt: skip
COMMON |= {f"R{61 + n}": (76.4, 54.5 + 2.1 * n, 0) for n in range(11)}

HEADERS = {"J61": 8, "J62": 8, "J63": 8, "J64": 36}
"""Pin headers, soldered from below; their number of pins."""

LABELS = (
    ("tomoskin", 43.0, 77.6, 2.2), ("rev 1: NOT BUILT, untested", 43.0, 80.2, 1.0),
    ("12 V DC IN", 7.5, 80.4, 1.2), ("centre +, 0.5 A", 7.5, 82.2, 0.8),
    ("isolated supply", 7.5, 83.5, 0.8),
    ("UP TO 100 mA INTO THE SKIN", 64.0, 85.2, 1.1), ("DIRECT CURRENT.", 64.0, 87.2, 1.1),
    ("NEVER ON PEOPLE.", 64.0, 89.2, 1.1),
    ("AGAINST", 60.7, 68.4, 1.0), ("1-2 electrode, 2-3 0 V", 63.0, 70.0, 0.8),
    ("MIDDLE", 60.7, 75.2, 1.0), ("1-2 2.5 V, 2-3 0 V", 62.3, 76.7, 0.8),
    ("Arduino Mega 2560 below", 44.0, 93.8, 1.0), ("CERN-OHL-W-2.0", 66.0, 93.8, 0.8),
)  # fmt: skip

TEST_POINTS = {
    "TP1": "+12V", "TP2": "-5V", "TP3": "2.5V", "TP4": "GND", "TP5": "GND", "TP6": "+5V",
    "TP21": "SENSE", "TP22": "BUS", "TP41": "MINUS", "TP42": "MIDDLE",
}  # fmt: skip
"""What stands above each test point."""


def width(channels: int) -> float:
    """Of the board, mm."""
    return 90.6 if channels == 8 else channels * TILE + 2 * MARGIN


def outline(channels: int) -> list[tuple[float, float]]:
    """Corners; beyond the Mega a long board is as high as its channels and demultiplexers."""
    right, mega = width(channels), width(8)
    if right == mega:
        return [(0, 0), (right, 0), (right, HEIGHT), (0, HEIGHT)]
    return [(0, 0), (right, 0), (right, STEP), (mega, STEP), (mega, HEIGHT), (0, HEIGHT)]


def places(channels: int) -> dict[str, Place]:
    """Of every part that may be on the board, by its reference."""
    found = dict(COMMON)
    for number in range(channels):
        for local, (x, y, turn) in TILES.items():
            letter = local.rstrip("0123456789")
            reference = f"{letter}{100 * (number + 1) + int(local[len(letter) :])}"
            found[reference] = (MARGIN + TILE * number + x, y, turn)
    return found
