"""A skin file for a recording: what its rows and its untouched frame say, and what they do not."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np

from tomoskin.core import DataError, IntArray, PatternError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern, electrodes_of, named, undirected
from tomoskin.model.skin import Skin
from tomoskin.pipeline.electrode_order import order_fault, untouched
from tomoskin.pipeline.frame_result import DOUBTED, ModelAgreement
from tomoskin.sensing.signal import Recording

_MOST = 32
"""Electrodes of a skin file."""

_DIAMETER, _COVERED = 0.2, 0.3
"""m, of the sheet that is assumed, and the part of its rim that electrodes cover."""

_RESISTANCE = 1e3
"""Ω of a square, where nothing is known of it."""

_VOLTS = (1e-3, 1e7)
"""Ω of a square; what is fitted beyond is of other units than V."""


def guess_skin(recording: Recording) -> str:
    """The text of a skin file, whose comments say what is sure and what no data tell.

    Electrodes and pattern are those of the rows; sheet resistance and polarity are fitted to the
    untouched frame of a round sheet, where the file has one.

    Raises
    ------
    DataError
        When the file has too many electrodes for a skin file, or too few.
    PatternError
        When its currents into many electrodes do not combine into the drives of pairs.
    """
    n = electrodes_of(recording.drive, recording.measure)
    if not 4 <= n <= _MOST:
        raise DataError(f"expected 4 to {_MOST} electrodes, got {n}", where=recording.source)
    drive, certain = _drive(recording, n)
    skin = Skin.from_toml(_text(recording, n, drive))
    if recording.is_change:
        comments = ["Not in the data, which are differences: size, polarity, order of electrodes."]
        return _text(recording, n, [*certain, *drive], head=comments)
    model = ForwardModel(skin.mesh(), skin.pattern(), skin.contact_impedance, skin.current)
    state = model.at(skin.conductivity)
    agreement = ModelAgreement.of(untouched(recording.in_order_of(skin.pattern())), state.voltages)
    resistance = agreement.size * _RESISTANCE
    if not _VOLTS[0] < resistance < _VOLTS[1]:
        resistance = _RESISTANCE
    potential = float(np.abs(state.electrode_potentials).max()) * resistance / _RESISTANCE
    head = [f"A round sheet agrees with the untouched frame by {abs(agreement.cosine):.3f} (of 1)."]
    if abs(agreement.cosine) < DOUBTED:
        head.append(
            "So the sheet is not round, or its electrodes stand in another order: not sure."
        )
    if fault := order_fault(recording, state.transfer_resistance):
        head.append(f"Check the order of the electrodes: {fault}.")
    if agreement.cosine < 0.0:
        drive = [*drive, "# From the untouched frame.", 'polarity = "reversed"']
    return _text(
        recording, n, [*certain, *drive], head=head, resistance=resistance, potential=potential
    )


def _drive(recording: Recording, n: int) -> tuple[list[str], list[str]]:
    """Keys of the pattern, and the comment on them; named patterns where they hold all rows."""
    if recording.spread:
        recording.in_order_of(Pattern.adjacent(n))
        said = "Chosen: currents into many electrodes are summed to the drives of any pattern."
        return ['pattern = "adjacent"'], [f"# {said}"]
    once = recording.without_repeats()
    touches = (once.drive[:, :, None] == once.measure[:, None, :]).any(axis=(1, 2))
    kept = ~touches if not touches.all() else touches
    drive, measure = once.drive[kept], once.measure[kept]
    names, lacking = list[str](), _rows(drive, measure)
    for name in ("all_pairs", "adjacent", *(f"skip:{k}" for k in range(1, n - 2)), "opposite"):
        with suppress(PatternError):
            pattern = named(name, n)
            own = _rows(pattern.drive, pattern.measure)
            if own <= _rows(drive, measure) and own & lacking:
                names.append(name)
                lacking -= own
    if not lacking:
        return [f'pattern = "{"+".join(names)}"'], ["# Sure: these are the rows of the file."]
    tables = [_table("drive", drive), _table("measure", measure)]
    return tables, ["# Sure: the rows of the file, which no named pattern has."]


def _table(name: str, rows: IntArray) -> str:
    """The key of a table, eight rows a line."""
    text = [", ".join(map(str, rows[k : k + 8].tolist())) for k in range(0, len(rows), 8)]
    return f"{name} = [\n" + ",\n".join(f"    {line}" for line in text) + ",\n]"


def _rows(drive: IntArray, measure: IntArray) -> set[tuple[int, ...]]:
    """Rows without the way round of their pairs, with their reciprocals."""
    rows = undirected(drive, measure)
    return {tuple(row) for row in np.vstack([rows, rows[:, [2, 3, 0, 1]]]).tolist()}


def _text(
    recording: Recording,
    n: int,
    drive: list[str],
    *,
    head: list[str] | None = None,
    resistance: float = _RESISTANCE,
    potential: float = 0.06,
) -> str:
    source = Path(recording.source).name.replace('"', "")
    width = 1e3 * np.pi * _DIAMETER * _COVERED / n
    return "\n".join([
        f"# Guessed from {source}.",
        *(f"# {line}" for line in head or ()),
        "format = 1", "",
        "[skin]", 'name = "guess"', f'description = "Guessed from {source}"', "",
        "[outline]",
        "# Not in the data: shape and size.",
        'shape = "disc"', f'diameter = "{1e3 * _DIAMETER:g} mm"', "",
        "[electrodes]",
        "# Sure: the rows of the file name so many.",
        f"count = {n}",
        "# No data can tell where E1 is, nor which way the others follow, seen from the front.",
        'first = "90 deg"', 'order = "clockwise"',
        "# Not in the data.",
        f'width = "{width:.3g} mm"', 'contact_impedance = "0.02 ohm*m"', "",
        "[material]",
        "# Fitted to the untouched frame where that can be in volts; right for the true current.",
        f'sheet_resistance = "{resistance:.4g} ohm/sq"', "",
        "[drive]",
        *drive,
        "# Not in the data.",
        'current = "1 mA"', "",
        "[readout]",
        "# Not in the data: what a board of your own would need. Images of files do without.",
        f"gain = {np.clip(2.0 / potential, 0.01, 1e4):.3g}", "",
        "[inverse]",
        "# Ratios to the untouched frame need no unit.",
        f'difference = "{"plain" if recording.is_change else "normalised"}"', "",
        "[touch]",
        "# Whatever changed: regions of the image, less and more conductive.",
        'method = "image"', 'sign = "both"', "",
    ])  # fmt: skip
