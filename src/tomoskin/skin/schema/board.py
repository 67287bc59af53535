"""The skin file: what is driven and read, and how the board reads it."""

from __future__ import annotations

from tomoskin.skin.kinds import Choice, Number, Quantity, Rows, Text, Whole
from tomoskin.skin.schema.entry import Key, Section

_ELECTRODE = Whole(0, 31)

BOARD: tuple[Section, ...] = (
    Section(
        "drive",
        "Where current flows and what is read: a named pattern, or two tables of your own.",
        (
            Key(
                "pattern",
                Text(),
                "adjacent, opposite, all_pairs, skip:K, or several joined by +.",
                default="adjacent",
                unless="drive",
            ),
            Key(
                "drive",
                Rows(_ELECTRODE, ("source", "sink"), 1),
                "Driven electrodes of each measurement, counted from 0.",
                needs="measure",
            ),
            Key(
                "measure",
                Rows(_ELECTRODE, ("plus", "minus"), 1),
                "Read electrodes of each measurement, counted from 0.",
                needs="drive",
            ),
            Key(
                "current",
                Quantity("current", "mA", 0.001, 1000),
                "Driven current.",
                required=True,
            ),
            Key(
                "polarity",
                Choice(("normal", "reversed")),
                "reversed: voltages come with the opposite sign, as from swapped amplifier inputs; "
                "`tomoskin calibrate wiring` finds it.",
            ),
        ),
    ),
    Section(
        "readout",
        "The amplifier and converter: counts = (gain · potential + offset) / reference · 2^bits.",
        (
            Key("adc_bits", Whole(8, 16), "Resolution of the converter.", default=10),
            Key(
                "reference_voltage",
                Quantity("voltage", "V", 0.5, 10),
                "Full scale of the converter.",
                default="5 V",
            ),
            Key("gain", Number(0.01, 10_000), "Gain in front of the converter.", default=40),
            Key(
                "offset",
                Quantity("voltage", "V", -10, 10),
                "Voltage at the converter for a potential of 0 V.",
                default="0 V",
            ),
            Key(
                "oversampling",
                Whole(1, 64),
                "Readings summed for one sample; the sum must fit in 16 bits.",
                default=16,
            ),
            Key(
                "settling",
                Quantity("time", "ms", 0, 1000),
                "Wait after each switch of the drive.",
                default="2 ms",
            ),
            Key(
                "tick_rate",
                Quantity("frequency", "kHz", 0.1, 100_000),
                "Rate of the device's clock.",
                default="250 kHz",
            ),
        ),
    ),
)
"""What the board is set to."""
