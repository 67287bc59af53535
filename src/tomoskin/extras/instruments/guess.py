"""A skin file for a recording: what its rows and its untouched frame say, and what they do not; and
whether another order of its electrodes would fit them better."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import DataError, FloatArray, IntArray, PatternError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.pattern import Pattern, electrodes_of, named, signed, undirected
from tomoskin.model.skin import Skin
from tomoskin.pipeline import DOUBTED, ModelAgreement
from tomoskin.sensing.signal import Recording

_LARGEST = 32
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
    if not 4 <= n <= _LARGEST:
        raise DataError(f"expected 4 to {_LARGEST} electrodes, got {n}", where=recording.source)
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


_BEND = 0.1
"""Voltages are compared by logarithms; by themselves below this part of the median."""

_MOST = 3.0
"""A single measurement counts no more than this."""

_APART = 0.3
"""Two orders differ in the measurements that they expect to differ by so much."""

_PART = 0.05
"""Less of the measurements decides nothing."""

_BETTER = 0.6
"""Another order is named that leaves at most this part of the misfit where the two differ."""

_FITS = 0.45
"""Mean misfit of all measurements above which another order is no explanation either."""

_ALL_PAIRS, _NEAR = 16, 3
"""Of more electrodes than the first, only those so near are tried in exchange."""

_AT_DRIVE = 2
"""Electrodes after the first driven one at which the first free pair begins."""

_TIE = 0.05
"""Orders of another kind that are as good up to this leave open which it is."""


def order_fault(recording: Recording, resistance: FloatArray) -> str | None:
    """What is wrong with the order of the rows, in a sentence; None where nothing shows.

    ``recording`` has its rows as they are in the file; ``resistance`` (n, n) Ω is between the
    electrodes of the untouched skin's model. Nothing is said of files of differences, nor of more
    electrodes than the skin has.
    """
    n = len(resistance)
    if recording.is_change or electrodes_of(recording.drive, recording.measure) > n:
        return None
    drive = recording.drive if recording.spread else signed(recording.drive, n)
    currents = np.zeros((len(drive), n))
    currents[:, : drive.shape[1]] = drive
    readers = signed(recording.measure, n)
    measured = untouched(recording)
    free = ~((currents != 0.0) & (readers != 0.0)).any(axis=1)
    kept = np.isfinite(measured) & (free if free.mean() > _PART else True)
    model = _voltages(resistance, currents, readers)
    if not (measured[kept].any() and model[kept].any()):
        return None
    sizes = False
    if measured[kept] @ model[kept] < 0.0:
        measured = -measured
    if (measured[kept] >= 0.0).all():  # perhaps sizes, whose signs are not known
        model, sizes = np.abs(model), True
    orders = []
    for kind, name, expected in _wirings(resistance, currents, readers):
        ratio, rest = _compared(measured, model, np.abs(expected) if sizes else expected, kept)
        if rest <= _FITS:
            orders.append((ratio, 0, kind, name))
    for kind, name, of, far in (*_shifts(len(model), n), *_turns(recording, n)):
        ratio, rest = _compared(measured, model, model[of], kept & kept[of])
        if rest <= _FITS:
            orders.append((ratio, far, kind, name))
    if not orders or min(orders)[0] > _BETTER:
        return None
    return _sentence(orders)


def untouched(recording: Recording) -> FloatArray:
    """(n_rows,) its reference, or the mean of its idle frames, real."""
    values = recording.reference
    if values is None:
        values = recording.voltages[: recording.idle].mean(axis=0)
    if np.iscomplexobj(values):
        phase = np.angle(np.nansum(values**2)) / 2.0
        values = (values * np.exp(-1j * phase)).real
    return np.asarray(values, dtype=np.float64)


def _voltages(resistance: FloatArray, currents: FloatArray, readers: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("re,re->r", currents @ resistance, readers))


def _wirings(
    resistance: FloatArray, currents: FloatArray, readers: FloatArray
) -> Iterator[tuple[str, str, FloatArray]]:
    """Kind, words and voltages (n_rows,) of other orders of the electrodes."""
    n = len(resistance)
    for pair in combinations(range(n), 2):
        if n > _ALL_PAIRS and min(pair[1] - pair[0], n - pair[1] + pair[0]) > _NEAR:
            continue
        turned = np.arange(n)
        turned[list(pair)] = pair[::-1]
        name = f"E{pair[0] + 1} and E{pair[1] + 1} are exchanged"
        yield name, name, _voltages(resistance, currents[:, turned], readers[:, turned])
    for way, kind in ((1, "shifted against"), (-1, "counted the other way round than")):
        for by in range(n):
            turned = (way * np.arange(n) + by + (way > 0)) % n
            if (turned != np.arange(n)).any():
                expected = _voltages(resistance, currents, readers[:, turned])
                yield kind, f"the measuring electrodes are {kind} the driven ones", expected


def _shifts(n_rows: int, n: int) -> Iterator[tuple[str, str, IntArray, int]]:
    """Kind, words, the row (n_rows,) that each value would be of, and how far that is."""
    for shift in range(-n, n + 1):
        if shift:
            name = f"the values are shifted by {abs(shift)} rows of the tables"
            yield "values", name, np.roll(np.arange(n_rows), shift), abs(shift)


def _turns(recording: Recording, n: int) -> Iterator[tuple[str, str, IntArray, int]]:
    """The same for rows of each drive that begin elsewhere: at the drive, where the tables begin at
    E1, as pyEIT's ``rotate_meas`` and most boards of 16 electrodes have it; and for the reverse."""
    if recording.spread:
        return
    begin = _first_of(recording.drive, n)
    place = _first_of(recording.measure, n)
    starts = (recording.drive[1:] != recording.drive[:-1]).any(axis=1)
    group = np.cumsum(np.append(False, starts))
    tried = {tuple(range(len(group)))}
    for after in range(n):
        where = "at the drive" if after <= _AT_DRIVE else f"{after} electrodes after the drive"
        of = np.lexsort(((place - begin - after) % n, group))
        if tuple(of.tolist()) not in tried:
            tried.add(tuple(of.tolist()))
            yield "turned", f"the rows of each drive begin {where}", of, after
    of = np.lexsort((place, group))
    if tuple(of.tolist()) not in tried:
        yield "from E1", "the rows of each drive begin at E1, not where the tables do", of, 0


def _first_of(pairs: IntArray, n: int) -> IntArray:
    """(n,) the electrode of each pair from which the other one is less than half a round ahead."""
    ahead = (pairs[:, 1] - pairs[:, 0]) % n
    return np.where(2 * ahead <= n, pairs[:, 0], pairs[:, 1])


def _compared(
    measured: FloatArray, model: FloatArray, other: FloatArray, kept: NDArray[np.bool_]
) -> tuple[float, float]:
    """Misfit of the other order over that of the own, where they differ; its mean of all rows."""
    (data, own, new) = (_bent(values[kept]) for values in (measured, model, other))
    apart = np.abs(own - new) > _APART
    if apart.sum() < max(_PART * len(data), 6):
        return np.inf, np.inf
    rest = np.minimum(np.abs(data - new), _MOST)
    before = np.minimum(np.abs(data - own)[apart], _MOST).mean()
    return float(rest[apart].mean() / max(before, 1e-9)), float(rest.mean())


def _bent(values: FloatArray) -> FloatArray:
    return np.asarray(np.arcsinh(values / (_BEND * np.median(np.abs(values)) + 1e-300)))


def _sentence(orders: list[tuple[float, int, str, str]]) -> str:
    """The best order, the smallest shift of those that are as good; or that it is left open."""
    best = min(orders)[0] + _TIE
    likely = sorted(((shift, kind, name) for ratio, shift, kind, name in orders if ratio <= best))
    if len({kind for _, kind, _ in likely}) > 1:
        return (
            "its rows do not stand in the order of its tables: electrodes, or values, are shifted"
        )
    return f"its untouched frame looks as if {likely[0][2]}"
