"""The Pico's front end, by its decks: ADG1606 drive, CD74HCT4067 read, an INA821 amplifies."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

from results import FILE as MEGA
from results import Figures
from spice import run

PARTS = Path(__file__).resolve().parent / "front_end.toml"
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

_LOADS = (0.5, 1, 5, 10, 20, 30, 40, 50, 60, 80, 100)


def drive() -> Figures:
    """Accuracy of the current from 0.5 to 20 ohm, and the most that it drives, ohm."""
    said = run("pico_drive", sense=SENSE, loads=" ".join(map(str, _LOADS)))
    amperes = dict(zip(_LOADS, said["amperes"], strict=True))
    held = [load for load in _LOADS if abs(amperes[load] / AMPERES - 1) < 0.01]
    error = max(abs(amperes[load] / AMPERES - 1) for load in _LOADS if load <= 20)
    return {"current_error": error, "load": max(held)}


def settling(step: float = 1 / GAIN) -> float:
    """Seconds after the multiplexer until half an LSB, for a step of V at the input."""
    said = run("pico_settling", step=step, gain=GAIN, half=LSB / 2)
    return said["settled"][0] - 20e-6


def settling_of_tree(step: float = 1 / GAIN, gap: float = 40e-9) -> float:
    """The same with 32 electrodes, from one multiplexer to the other, which a decoder enables
    ``gap`` s after the first has been disabled; below zero: before."""
    said = run("pico_tree", step=step, gain=GAIN, half=LSB / 2, gap=gap)
    return said["settled"][0] - 20e-6


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
    table = tomllib.loads(PARTS.read_text(encoding="utf-8"))["part"]
    tree = electrodes > 16
    return float(
        sum((row["count"] + tree * row.get("tree", 0)) * row["each"] for row in table.values())
    )
