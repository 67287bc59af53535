"""The Pico's front end, by its decks: ADG1606 drive, CD74HCT4067 read, an INA821 amplifies."""

from __future__ import annotations

import math
import tomllib

import bill
from circuit import Circuit
from results import FILE as MEGA, Figures
from spice import run

PICO = tomllib.loads(MEGA.read_text(encoding="utf-8"))["pico"]
"""Its record, whose gain, reference and current the decks and the schematic are held to."""

GAIN, AMPERES = PICO["gain"], PICO["current"]
SENSE = 1 / (1 / 24.9 + 1 / 1540)
"""Ω, of two resistors."""

REFERENCE, BITS = PICO["reference"], PICO["adc_bits"]
LSB = REFERENCE / (1 << BITS)
CONVERTER_NOISE = 0.46
"""LSB, standard deviation of a conversion of an ADS7042: 70 dB of signal to noise."""

OWN_NOISE = 2.9
"""The same of the RP2040's own converter, whose 8.7 effective bits are 54 dB."""

DUMP = 22
"""Ω through which the current flows while no source is enabled."""

_LOADS = (0.2, 0.5, 1, 5, 10, 20, 30, 41, 50, 60, 80, 100)


def drive() -> Figures:
    """Error of the current from 0.2 to 41 ohm (contacts of 0.1 to 20), and the most load, ohm."""
    said = run("pico_drive", sense=SENSE, loads=" ".join(map(str, _LOADS)))
    amperes = dict(zip(_LOADS, said["amperes"], strict=True))
    held = [load for load in _LOADS if abs(amperes[load] / AMPERES - 1) < 0.01]
    error = max(abs(amperes[load] / AMPERES - 1) for load in _LOADS if load <= 41)
    return {"current_error": error, "load": max(held)}


def beginning(contact: float, dead: str, dump: float = DUMP) -> Figures:
    """A drive after a dead time: peak over the current, seconds until it stays within 1 %."""
    said = run("pico_dump", sense=SENSE, contact=contact, dead=dead, dump=dump)
    begin = 20e-6 + float(dead.rstrip("u")) * 1e-6
    return {"peak": said["peak"][0] / said["last"][0], "settling": said["settled"][0] - begin}


def settling(step: float = 1 / GAIN, contact: float = 20) -> float:
    """Seconds after the multiplexer until half an LSB, for a step of V behind contacts of ohm."""
    said = run("pico_settling", step=step, contact=contact, gain=GAIN, half=LSB / 2)
    return said["settled"][0] - 20e-6


def settling_of_tree(step: float = 1 / GAIN, gap: float = 40e-9) -> float:
    """The same with 32 electrodes, from one multiplexer to the other, which a decoder enables
    ``gap`` s after the first has been disabled; below zero: before."""
    said = run("pico_tree", step=step, gain=GAIN, half=LSB / 2, gap=gap)
    return said["settled"][0] - 20e-6


def open_sink(minus: float, limit: float = 1000.0) -> Figures:
    """V at the converter's pin, and A through the resistor of ``limit`` ohm before it, where an
    electrode at 2.5 V is read against one at ``minus`` V: a sink makes no contact."""
    said = run("pico_open_sink", plus=2.5, minus=minus, gain=GAIN, limit=limit)
    return {name: value[0] for name, value in said.items()}


def noise(signal: float = 1 / GAIN, converter: float = CONVERTER_NOISE) -> Figures:
    """Of a conversion, at the amplifier's input: amplifier and current, V; all, V; all in ohm."""
    pin = run("pico_noise", gain=GAIN, signal=signal)["pin"][0]
    total = math.hypot(pin, converter * LSB) / GAIN
    return {"amplifier": pin / GAIN, "total": total, "ohms": total / AMPERES}


def mega_noise() -> Figures:
    """The same of the Mega's board, by its decks."""
    board = tomllib.loads(MEGA.read_text(encoding="utf-8"))["mega"]["electronics"]
    return {"total": board["input_noise"], "ohms": board["input_noise"] / 0.1}


def cost(electrodes: int = 16) -> float:
    """Euros of the parts of one front end of 16 or 32 electrodes, with the Pico."""
    parts = bill.total(Circuit.read("pico-16").parts, 1)
    if electrodes == 16:
        return parts
    tree = tomllib.loads(bill.PARTS.read_text(encoding="utf-8"))["tree"]
    more = sum(count * bill.known()[name].each[0] for name, count in tree.items())
    return parts + float(more)
