"""What the decks say of the thesis's circuit and of ours, in the record of the board.

``python hardware/results.py`` writes them, ``… --check`` fails when the file says something else.
"""

from __future__ import annotations

import math
import sys
import tomllib
from pathlib import Path

from spice import run

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / "src" / "tomoskin" / "board" / "source" / "boards.toml"
SECTION = "[mega.electronics]\n"
Figures = dict[str, float]

LSB = 5 / 1024
"""Of the converter, V."""
CONVERTER_NOISE = 0.7
"""Standard deviation of one conversion of an ATmega2560 before it is rounded, LSB: assumed."""
GAIN = 35
AMPERES = 0.1
DEAD_TIME = "5u"
"""The host's default."""
SINK_LINE = {"against": "0", "middle": "0", "tap": "0"}
NEIGHBOUR = {"against": "v(on)>2.5?(v(new)>2.5?v(e8):v(e7)):0", "middle": "2.5", "tap": "3.3k"}
AMPLIFIER = {"source": SINK_LINE, "mended": NEIGHBOUR}
"""What the amplifiers read against: the sink's line; the electrode before the sink."""
_LOADS = (0.5, 1, 5, 10, 20, 50, 80, 90, 95, *range(100, 116), 200, 500, 1000, 2000)


def compliance(variant: str, loads: tuple[float, ...] = _LOADS) -> Figures:
    """Accuracy from 0.5 to 20 ohm, the most that drives a load, switches."""
    said = run("compliance", variant=variant, loads=" ".join(map(str, loads)), amps=AMPERES)
    amperes = dict(zip(loads, said["amperes"], strict=True))
    bus = dict(zip(loads, said["bus"], strict=True))
    held = [load for load in loads if abs(amperes[load] / AMPERES - 1) < 0.01]
    loss = amperes[0.5] / amperes[80] - 1
    low = said["sink_drop"][0] / amperes[0.5]
    high = bus[80] / amperes[80] - 80 - low - run("layout")["rbus"][0]  # no reading sees BUS
    return {
        "current_error": max(abs(amperes[load] / AMPERES - 1) for load in loads if load <= 20),
        "compliance": max(held) * AMPERES,
        "output_resistance": min(80 / max(loss, 1e-12), 1e6),
        "switch_resistance": (low + high) / 2,
    }


def switching(variant: str, **change: object) -> Figures:
    """The step from one drive to the next: peaks over the nominal current; settling."""
    values = {"amps": AMPERES, "dead": DEAD_TIME, "contact": 0.05, "ring": 1, "cut": "1m"}
    values |= {"gain": GAIN, "bandwidth": "200k"} | AMPLIFIER[variant] | change
    said = {name: value[0] for name, value in run("switching", variant=variant, **values).items()}
    dead = float(str(values["dead"]).rstrip("u")) * 1e-6
    amperes = float(str(values["amps"]))
    figures = {
        "peak": max(said["peak"], said["peak_old"]) / amperes,
        "idle_peak": said["peak_idle"] / amperes,
        "bus": said["bus_top"],
    }
    if "settled" in said and "early" in said:
        figures["settling"] = said["settled"] - 20e-6 - dead
        figures["time_constant"] = (said["settled"] - said["early"]) / math.log(48.8 / 2.44)
    return figures


def clipping(variant: str, contact: float, amperes: float) -> Figures:
    """A difference of two channels behind contacts: what it is and what is read, V; the pins, V."""
    against = {key: value for key, value in AMPLIFIER[variant].items() if key != "tap"}
    against["against"] = {"source": "0", "mended": "v(e7)"}[variant]
    ring = 0.1 / amperes
    values = {"amps": amperes, "contact": contact, "ring": ring, "gain": GAIN} | against
    said = run("contacts", variant=variant, **values)
    return {
        "truth": said["truth"][0],
        "read": said["read"][0],
        "above_ground": said["above_ground"][0],
        "pin": max(said["pin"]),
    }


def noise(signal: float) -> Figures:
    """Noise of amplifier and current at the pin, V, by a ``signal`` V at the input; gain, edge."""
    edge = 20 * math.log10(GAIN) - 3
    said = run("noise", gain=GAIN, signal=signal, bandwidth="200k", edge=edge)
    return {name: value[0] for name, value in said.items()}


def shared(step: float = 1 / GAIN) -> Figures:
    """One amplifier for all channels: settling after its multiplexer, s, and what is read, V."""
    said = run("shared", step=step, gain=GAIN, bandwidth="200k")
    return {"settling": said["settled"][0] - 20e-6, "last": said["last"][0]}


def fed(channels: int, lifted: float = 10.8) -> float:
    """A that all taps feed into U41's 5 V where a sink makes no contact: ``lifted`` V."""
    return channels * run("taps", lifted=lifted)["each"][0]


def measured() -> Figures:
    """The figures of the file, rounded to what means something."""
    rest = compliance("mended")
    step = switching("mended", **SINK_LINE)  # as the twin and the built-in skins have it
    pin = noise(1 / GAIN)["pin"]
    total = math.hypot(CONVERTER_NOISE, pin / LSB)
    high = clipping("source", 20, AMPERES)["pin"]
    return {
        "noise": float(f"{total:.3g}"),
        "input_noise": float(f"{total * LSB / GAIN:.3g}"),
        "amplifier_noise": float(f"{pin / GAIN:.2g}"),
        "compliance": float(f"{rest['compliance']:.3g}"),
        "output_resistance": float(f"{rest['output_resistance']:.2g}"),
        "switch_resistance": float(f"{rest['switch_resistance']:.2g}"),
        "low_rail": 0.0,
        "high_rail": round(high, 2),
        "time_constant": float(f"{step['time_constant']:.2g}"),
        "settling": float(f"{step['settling']:.2g}"),
        "current_error": float(f"{rest['current_error']:.1g}"),
        "peak": float(f"{step['peak']:.3g}"),
    }


def written(figures: Figures, text: str) -> str:
    """The file, now ``text``, with these figures in their section."""
    above, below = text.split(SECTION)
    rest = below[below.index("\n\n") :]
    return (
        above + SECTION + "\n".join(f"{key} = {value!r}" for key, value in figures.items()) + rest
    )


def main() -> int:
    """Write the figures, or say whether those that are there are right."""
    old = FILE.read_text(encoding="utf-8")
    made = written(measured(), old)
    if sys.argv[1:] != ["--check"]:
        FILE.write_text(made, encoding="utf-8")
    elif tomllib.loads(old) != tomllib.loads(made):
        print(f"{FILE.name} is stale: run python hardware/{Path(__file__).name}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
