"""The drawings of the docs: the whole board, the current source, one channel, a wired skin."""

from __future__ import annotations

from schematic.drawing import Sheet
from schematic.wiring import wiring


def drawings() -> dict[str, str]:
    """The drawings of the docs by their names."""
    sheets = {"channel": _chain(_bridge()), "source": _source(), "board": _board()}
    return {name: sheet.svg() for name, sheet in sheets.items()} | {"skin": wiring()}


def _source() -> Sheet:
    """Current source and dump."""
    s = Sheet(760, 330)
    s.rail(70, 40, "+12 V")
    s.wire((70, 40), (70, 60))
    s.box(35, 60, 70, 40, "LM4041", "1.225 V")
    s.wire((70, 100), (70, 190))
    s.dot(70, 150)
    s.resistor(70, 190, "10k")
    s.wire((70, 230), (70, 245))
    s.ground(70, 245)
    s.wire((70, 150), (180, 150))
    s.amplifier(180, 135, "OPA197")
    s.wire((236, 165), (265, 165))
    s.dot(252, 165)
    s.resistor(265, 165, "100", across=True)
    s.wire((305, 165), (338, 165))
    s.rail(370, 40, "+12 V")
    s.wire((370, 40), (370, 55))
    s.resistor(370, 55, "12.4 Ω ∥ 1.02k")
    s.wire((370, 95), (370, 145))
    s.dot(370, 115)
    s.fet(370, 145, "IRFR9024N", p=True)
    s.wire((370, 115), (290, 115))
    s.resistor(250, 115, "1k", across=True)
    s.wire((250, 115), (160, 115), (160, 180), (180, 180))
    s.dot(160, 180)
    s.wire((160, 180), (160, 230), (195, 230))
    s.wire((195, 220), (195, 240))
    s.wire((201, 220), (201, 240))
    s.wire((201, 230), (252, 230), (252, 165))
    s.text(198, 258, "470p", "middle")
    s.wire((370, 185), (370, 215), (700, 215))
    s.text(706, 219, "BUS")
    s.dot(560, 215)
    s.resistor(560, 230, "22 Ω")
    s.wire((560, 215), (560, 230))
    s.wire((560, 270), (560, 272))
    s.fet(560, 272, "IRLML6344")
    s.ground(560, 312)
    s.wire((528, 292), (480, 292))
    s.box(330, 272, 150, 40, "no source enabled", "opens 1.5 µs later")
    return s


def _bridge() -> Sheet:
    """Half H-bridge of one channel."""
    s = Sheet(1090, 400)
    s.text(12, 128, "SOURCE_n")
    s.wire((84, 124), (90, 124))
    s.resistor(90, 124, "100", across=True)
    s.wire((130, 124), (168, 124))
    s.dot(150, 124)
    s.wire((150, 124), (150, 150))
    s.resistor(150, 150, "100k")
    s.ground(150, 190)
    s.fet(200, 104, "2N7002")
    s.ground(200, 144)
    s.rail(200, 30, "+12 V")
    s.wire((200, 30), (200, 38))
    s.resistor(200, 38, "2.2k")
    s.wire((200, 78), (200, 104))
    s.dot(200, 90)
    s.wire((200, 90), (288, 90))
    s.text(320, 40, "BUS", "middle")
    s.wire((320, 46), (320, 70))
    s.fet(320, 70, "IRLML9301", p=True)
    s.wire((320, 110), (320, 270))
    s.dot(320, 190)
    s.fet(320, 270, "IRLML6344")
    s.ground(320, 310)
    s.text(12, 294, "SINK_n")
    s.wire((62, 290), (90, 290))
    s.resistor(90, 290, "1k", across=True)
    s.wire((130, 290), (288, 290))
    s.dot(200, 290)
    s.wire((200, 290), (200, 305))
    s.resistor(200, 305, "100k")
    s.ground(200, 345)
    return s


def _chain(s: Sheet) -> Sheet:
    """The amplifier chain of one channel, from its bridge on."""
    s.wire((320, 190), (450, 190))
    s.text(382, 182, "electrode n", "middle")
    s.dot(440, 190)
    s.wire((440, 190), (440, 240))
    s.box(405, 240, 70, 40, "SMAJ15A")
    s.ground(440, 280)
    s.resistor(450, 190, "1k", across=True)
    s.wire((490, 190), (580, 190))
    s.dot(512, 190)
    s.wire((512, 190), (512, 205))
    s.capacitor(512, 205, "100p")
    s.amplifier(580, 175, "INA118, G = 35")
    s.wire((580, 220), (570, 220), (570, 330), (545, 330))
    s.resistor(505, 330, "1k", across=True)
    s.wire((505, 330), (490, 330))
    s.text(484, 334, "MINUS", "end")
    s.text(484, 354, "electrode before the sink,", "end")
    s.text(484, 371, "by CD74HC4067 (or sink line)", "end")
    s.text(600, 276, "REF: 2.5 V (or 0 V)")
    s.wire((606, 222), (606, 260))
    s.wire((636, 205), (660, 205))
    s.resistor(660, 205, "1k", across=True)
    s.wire((700, 205), (740, 205))
    s.dot(720, 205)
    s.capacitor(720, 205, "10n")
    s.resistor(740, 205, "10k", across=True)
    s.wire((780, 205), (830, 205))
    s.dot(800, 205)
    s.wire((800, 205), (800, 150))
    s.box(765, 110, 70, 40, "BAT54S", "0 to 5 V")
    s.amplifier(830, 190, "TLV2371, 5 V")
    s.wire((886, 220), (910, 220))
    s.dot(898, 220)
    s.wire((898, 220), (898, 265), (820, 265), (820, 235), (830, 235))
    s.resistor(910, 220, "100", across=True)
    s.wire((950, 220), (985, 220))
    s.dot(965, 220)
    s.capacitor(965, 220, "10n")
    s.text(990, 224, "POTENTIAL_n")
    return s


def _board() -> Sheet:
    """The blocks of the whole board."""
    s = Sheet(860, 330)
    s.box(20, 130, 130, 90, "Arduino", "Mega 2560", "hardware/pins.toml")
    s.box(230, 30, 170, 50, "CD74HC237 per 8:", "source address → 1 of 8")
    s.box(230, 150, 170, 50, "CD74HC237 per 8:", "sink address → 1 of 8")
    s.box(230, 260, 170, 50, "CD74HC4067:", "electrode before the sink")
    s.box(480, 30, 150, 50, "level shifters,", "p-MOSFETs from BUS")
    s.box(480, 150, 150, 50, "n-MOSFETs", "to ground")
    s.box(690, 30, 150, 50, "current source", "and dump → BUS")
    s.box(690, 150, 150, 50, "skin,", "8 or 16 electrodes")
    s.box(480, 260, 150, 50, "8 or 16 amplifiers")
    s.wire((150, 150), (190, 150), (190, 55), (230, 55))
    s.wire((150, 175), (230, 175))
    s.wire((190, 175), (190, 272), (230, 272))
    s.dot(190, 175)
    for y in (55, 175):
        s.wire((400, y), (480, y))
    s.wire((690, 55), (630, 55))
    s.wire((630, 175), (690, 175))
    s.wire((555, 80), (555, 115), (730, 115), (730, 150))
    s.wire((765, 200), (765, 270), (630, 270))
    s.wire((480, 285), (400, 285))
    s.wire((555, 310), (555, 322), (85, 322), (85, 220))
    s.wire((765, 225), (440, 225), (440, 248), (315, 248), (315, 260))
    s.dot(765, 225)
    s.text(95, 318, "potentials")
    return s
