"""The board: current source, channels, amplifiers, logic, supplies, connector; 8 or 16 channels.

Values are those of decks/circuits.lib, block by block.
"""

from __future__ import annotations

import pins
from schematic import parts as p
from schematic.circuit import Circuit


def assembly(channels: int) -> Circuit:
    """The whole board of 8 or 16 channels."""
    table = pins.read(pins.TABLE.read_text(encoding="utf-8"))
    circuit = Circuit()
    supplies(circuit)
    connector(circuit, table, channels)
    current_source(circuit)
    dump(circuit, channels)
    reference(circuit, channels)
    for first in range(0, channels, 8):
        demultiplexers(circuit, first)
    for number in range(channels):
        channel(circuit, number)
        amplifier(circuit, number)
    return circuit


def supplies(c: Circuit) -> None:
    """12 V by a fuse and a clamp; -5 V from the Arduino's 5 V; 2.5 V, buffered."""
    c.add(p.JACK, "RAW GND")
    c.add(p.FUSE, "RAW +12V")
    c.add(p.CLAMP, "+12V GND")
    c.add(p.C, "+12V GND", "10u 25 V")
    c.add(p.PUMP, "PUMP+ GND PUMP- -5V +5V")
    c.add(p.C, "PUMP+ PUMP-", "10u")
    c.add(p.C, "-5V GND", "10u")
    c.add(p.R, "+5V HALF", "2.2k")
    c.add(p.REFERENCE_2V5, "HALF GND")
    c.add(p.FOLLOWER, "2V5 GND HALF 2V5 +5V")


def connector(c: Circuit, table: pins.Pins, channels: int) -> None:
    """The Arduino Mega 2560, pin by pin of the table; pull-downs on what must rest low."""
    wanted = {
        signal: pin
        for signal, pin in pins.signals(table).items()
        if not (signal.startswith("POTENTIAL") and int(signal.split("_")[1]) >= channels)
        and not (channels == 8 and signal.endswith("ENABLE_1"))
    }
    rows = ["GND GND p", "5V 5V s"]
    for signal, pin in wanted.items():
        kind = "i" if signal.startswith("POTENTIAL") else "-"
        rows.append(f"{pins.arduino(pin)} {signal} {kind}")
    mega = p.part("Arduino Mega 2560", "J", "headers", 40.0, ", ".join(rows))
    c.add(mega, " ".join(["GND", "+5V", *wanted]))
    for signal in wanted:
        if not signal.startswith("POTENTIAL"):
            c.add(p.R, f"{signal} GND", "10k")


def current_source(c: Circuit) -> None:
    """1.225 V below the rail across 12.4 || 1020 ohm: 100 mA into BUS, whatever its load."""
    c.add(p.REFERENCE_1V2, "+12V REF")
    c.add(p.R, "REF GND", "10k")
    c.add(p.PRECISE, "+12V SENSE", "12.4")
    c.add(p.R, "+12V SENSE", "1.02k")
    c.add(p.OPA, "DRIVE GND REF BACK +12V")
    c.add(p.R, "SENSE BACK", "1k")
    c.add(p.C, "DRIVE BACK", "470p C0G")
    c.add(p.R, "DRIVE GATE", "100")
    c.add(p.POWER_PFET, "GATE BUS SENSE")  # 0.9 W
    c.add(p.R, "+12V GATE", "100k")
    c.add(p.C, "+12V GND", "100n")


def dump(c: Circuit, channels: int) -> None:
    """While no source is enabled the current goes to ground; it opens 1.5 us after one is."""
    second = "SOURCE_ENABLE_1" if channels == 16 else "GND"
    c.add(p.NOR, f"{second} SOURCE_ENABLE_0 GND IDLE +5V")
    c.add(p.SIGNAL, "DUMP_GATE IDLE")
    c.add(p.R, "IDLE DUMP_GATE", "2.2k")
    c.add(p.NFET, "DUMP_GATE GND DUMP")
    c.add(p.R, "DUMP_GATE GND", "100k")
    c.add(p.POWER_R, "BUS DUMP", "22")


def reference(c: Circuit, channels: int) -> None:
    """What the amplifiers read against: the electrode before the sink, or the sink line."""
    taps = " ".join(f"TAP_{(n - 1) % channels}" if n < channels else "GND" for n in range(8))
    taps = " ".join(reversed(taps.split()))
    upper = [f"TAP_{n - 1}" if n < channels else "GND" for n in range(15, 7, -1)]
    select = "SINK_ENABLE_1" if channels == 16 else "GND"
    logic = f"SINK_ADDRESS_0 SINK_ADDRESS_1 GND {select} SINK_ADDRESS_2 GND"
    c.add(p.MUX, f"NEAR {taps} {logic} {' '.join(upper)} +5V")
    c.add(p.JUMPER, "NEAR MINUS GND", "against: electrode or sink line")
    c.add(p.JUMPER, "2V5 MIDDLE GND", "middle: 2.5 V or 0 V")
    c.add(p.C, "+5V GND", "100n")


def demultiplexers(c: Circuit, first: int) -> None:
    """One for the sources and one for the sinks of eight channels."""
    group = first // 8
    for kind in ("SOURCE", "SINK"):
        address = " ".join(f"{kind}_ADDRESS_{bit}" for bit in range(3))
        y = {n: f"{kind}_{first + n}" for n in range(8)}
        outputs = f"{y[7]} GND {y[6]} {y[5]} {y[4]} {y[3]} {y[2]} {y[1]} {y[0]}"
        c.add(p.DEMUX, f"{address} LATCH_0 GND {kind}_ENABLE_{group} {outputs} +5V")
        c.add(p.C, "+5V GND", "100n")


def channel(c: Circuit, n: int) -> None:
    """Half H-bridge: p-MOSFET from the bus by a level shifter, n-MOSFET to ground; a clamp."""
    c.add(p.R, f"SOURCE_{n} SHIFT_{n}", "100")
    c.add(p.R, f"SHIFT_{n} GND", "100k")
    c.add(p.SHIFTER, f"SHIFT_{n} GND HIGH_{n}")
    c.add(p.R, f"+12V HIGH_{n}", "2.2k")
    c.add(p.PFET, f"HIGH_{n} BUS EL_{n}")
    c.add(p.R, f"SINK_{n} LOW_{n}", "1k")
    c.add(p.R, f"LOW_{n} GND", "100k")
    c.add(p.NFET, f"LOW_{n} GND EL_{n}")
    c.add(p.CLAMP, f"EL_{n} GND")
    c.add(p.TERMINAL, f"EL_{n}", f"E{n + 1}")


def amplifier(c: Circuit, n: int) -> None:
    """INA118 at a gain of 35, filter, clamp, follower on 5 V, the converter's pin."""
    c.add(p.R, f"EL_{n} TAP_{n}", "1k")
    c.add(p.C, f"TAP_{n} GND", "100p C0G")
    c.add(p.R, f"MINUS NEG_{n}", "1k")
    c.add(p.C, f"NEG_{n} GND", "100p C0G")
    c.add(p.INA, f"RA_{n} NEG_{n} TAP_{n} -5V MIDDLE AMP_{n} +12V RB_{n}")
    c.add(p.R, f"RA_{n} RB_{n}", "1.47k")
    c.add(p.R, f"AMP_{n} FILTER_{n}", "1k")
    c.add(p.C, f"FILTER_{n} GND", "10n C0G")
    c.add(p.R, f"FILTER_{n} CLAMP_{n}", "10k")
    c.add(p.DIODE, f"GND +5V CLAMP_{n}")
    c.add(p.FOLLOWER, f"BUFFER_{n} GND CLAMP_{n} BUFFER_{n} +5V")
    c.add(p.R, f"BUFFER_{n} POTENTIAL_{n}", "100")
    c.add(p.C, f"POTENTIAL_{n} GND", "10n")
    c.add(p.C, "+12V GND", "100n")
    c.add(p.C, "-5V GND", "100n")
