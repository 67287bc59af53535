"""The table of pins: the firmware's header is made from it, the schematics are held to it.

``python hardware/pins.py`` writes ``firmware/avr/pins.h``, ``… --check`` fails when it is stale.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TABLE, HEADER = ROOT / "hardware" / "pins.toml", ROOT / "firmware" / "avr" / "pins.h"
EMULATOR = ROOT / "firmware" / "emulator" / "emulator.c"
Pins = dict[str, list[str]]

_COUNTS = {"source_address": 3, "sink_address": 3, "source_enable": 2, "sink_enable": 2}
_COUNTS |= {"latch": 1, "potential": 16}
_HEADERS = {
    "A": [f"D{n}" for n in range(22, 30)],
    "C": [f"D{n}" for n in range(37, 29, -1)],
    "F": [f"A{n}" for n in range(8)],
    "K": [f"A{n}" for n in range(8, 16)],
    "L": [f"D{n}" for n in range(49, 41, -1)],
}
"""The Arduino Mega 2560's names of a port's bits, 0 first."""


class PinError(Exception):
    """A table of pins that firmware or board cannot have."""


def read(text: str) -> Pins:
    """The table, checked against what firmware and Arduino can do; PinError otherwise."""
    pins: Pins = tomllib.loads(text)
    counts = {name: len(value) for name, value in pins.items()}
    if counts != _COUNTS:
        raise PinError(f"{TABLE.name}: expected {_COUNTS} pins, got {counts}")
    for problem in _problems(pins):
        raise PinError(problem)
    return pins


def signals(pins: Pins) -> dict[str, str]:
    """Pin of each signal of the board: SOURCE_ADDRESS_0 → PA0."""
    return {
        f"{name.upper()}_{number}": pin
        for name, group in pins.items()
        for number, pin in enumerate(group)
    }


def arduino(pin: str) -> str:
    """The Arduino's name of a pin: PA0 → D22."""
    return _HEADERS[pin[1]][int(pin[2])]


def header(pins: Pins) -> str:
    """``firmware/avr/pins.h``."""
    address, control = pins["source_address"][0][1], pins["latch"][0][1]
    mask = sum(1 << int(pin[2]) for pin in pins["source_address"] + pins["sink_address"])
    enables = [("SOURCE", "source_enable"), ("SINK", "sink_enable")]
    lines = [
        f"#define {name}_ENABLE_{8 * number} _BV({pin})"
        for name, key in enables
        for number, pin in enumerate(pins[key])
    ]
    return f"""\
/* Pins of the ATmega2560 board. Made by hardware/pins.py from hardware/pins.toml, to which
   a test holds the board's schematics: change that table, not this file.

   Per channel a p-MOSFET to the current and an n-MOSFET to ground, chosen by CD74HC237 3-to-8
   demultiplexers, one for the sources and one for the sinks of each eight channels. A channel's
   potential comes to the converter input of its number: 0 to 7 on port F, 8 to 15 on port K.
   Enables have pull-downs: pins float in reset. */
#ifndef TOMOSKIN_PINS_H
#define TOMOSKIN_PINS_H

#include <avr/io.h>

/* Addresses, to all demultiplexers: source on bits 0-2, sink on bits 3-5 of port {address}. */
#define ADDRESS_PORT PORT{address}
#define ADDRESS_DDR DDR{address}
#define ADDRESS_MASK 0x{mask:02X}u
#define SINK_SHIFT {pins["sink_address"][0][2]}u

/* Enables (E2, high connects), and the latch (LE, low takes the address): port {control}. */
#define CONTROL_PORT PORT{control}
#define CONTROL_DDR DDR{control}
{chr(10).join(lines)}
#define LATCH _BV({pins["latch"][0]})
#define ENABLES (SOURCE_ENABLE_0 | SOURCE_ENABLE_8 | SINK_ENABLE_0 | SINK_ENABLE_8)

#endif
"""


def _problems(pins: Pins) -> Iterator[str]:
    """What firmware or Arduino cannot have, with the names of both sides."""
    where = signals(pins)
    for signal, pin in where.items():
        if len(pin) != 3 or pin[1] not in _HEADERS or pin[2] not in "01234567":
            yield f"pins.toml has {signal} on {pin}: the Arduino Mega 2560's headers do not"
        other = next(name for name, used in where.items() if used == pin)
        if other != signal:
            yield f"pins.toml has both {other} and {signal} on {pin}"
    for number, pin in enumerate(pins["potential"]):
        wanted = f"P{'FK'[number // 8]}{number % 8}"
        if pin != wanted:
            yield f"hal_adc_start (hal_avr.c) has POTENTIAL_{number} on {wanted}, pins.toml {pin}"
    for signal, wanted in zip(
        list(where)[:6], [f"P{pins['source_address'][0][1]}{n}" for n in range(6)], strict=True
    ):
        if where[signal] != wanted:
            has = f"{signal} on {wanted}, pins.toml on {where[signal]}"
            yield f"hal_switches_address (hal_avr.c) has {has}"
    port = pins["latch"][0][:2]
    for signal, pin in list(where.items())[6:10]:
        if pin[:2] != port:
            yield (
                f"hal_switches_enable of hal_avr.c writes {signal} and LATCH in one go, "
                f"pins.toml has them on {pin} and {pins['latch'][0]}"
            )
    if pins["source_address"][0][:2] == port:
        yield f"hal_switches_disable (hal_avr.c) clears {port}, where pins.toml has addresses"


def emulator_problem(pins: Pins, text: str) -> str:
    """What ``emulator.c`` believes otherwise than the table, or nothing."""
    names = ("SOURCE_0", "SOURCE_8", "SINK_0", "SINK_8", "LATCH")
    group = pins["source_enable"] + pins["sink_enable"] + pins["latch"]
    bits = ", ".join(f"{n} = {1 << int(p[2])}" for n, p in zip(names, group, strict=True))
    ports = (pins["source_address"][0][:2], pins["latch"][0][:2])
    if bits in text and ports == ("PA", "PC"):
        return ""
    return f"emulator.c does not have {bits} on {ports[1]}, as pins.toml has them"


def check(table: str, made: str, emulator: str) -> str:
    """Why table, header and emulator do not belong together, or nothing."""
    try:
        pins = read(table)
    except PinError as error:
        return str(error)
    if made != header(pins):
        return "pins.h is not that of pins.toml: run python hardware/pins.py"
    return emulator_problem(pins, emulator)


def main() -> int:
    """Write the header, or say whether everything fits."""
    table = TABLE.read_text(encoding="utf-8")
    if sys.argv[1:] != ["--check"]:
        HEADER.write_text(header(read(table)), encoding="utf-8")
    emulator = EMULATOR.read_text(encoding="utf-8")
    problem = check(table, HEADER.read_text(encoding="utf-8"), emulator)
    print(problem, end="\n" if problem else "", file=sys.stderr)
    return bool(problem)


if __name__ == "__main__":
    sys.exit(main())
