"""What state frames show: said on the command line, or in the file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import typer

from tomoskin.core import DataError, FloatArray

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tomoskin.calibration import Codes, Examples


def marked(path: Path, dv: FloatArray, given: list[str], codes: Codes | None) -> Examples:
    """Examples of the frames ``dv`` (n, n_meas) of a file; ``codes`` where they are known before.

    Raises
    ------
    DataError
        When nothing says what the frames show (and ``codes`` are not known), or it is no label.
    """
    from tomoskin.calibration import Codes, Examples

    arrays = {} if given else _arrays(path)
    if "flags" in arrays:
        flags = np.asarray(arrays["flags"], dtype=np.float64)
        count = flags.shape[1] if flags.ndim == 2 else 0
        names = arrays.get("flag_names", np.arange(1, count + 1)).ravel().tolist()
        own = Codes(tuple(map(str, names)), exclusive=False)
        return Examples.of(codes or own, dv, flags)
    if given or "state" in arrays:
        labels = _ranges(given, len(dv)) if given else [str(s) for s in arrays["state"].tolist()]
        codes = codes or Codes.of_labels(labels)
        return Examples.of(codes, dv, codes.flags_of(labels))
    if codes is None:
        raise DataError(
            "says no states: expected state (n_frames,) or flags (n_frames, f)",
            where=str(path),
            hint="or --state idle=0:40 --state touch=40:80",
        )
    return Examples.of(codes, dv, np.full((len(dv), len(codes.names)), np.nan))


def _arrays(path: Path) -> dict[str, NDArray[Any]]:
    from tomoskin.core import load_arrays
    from tomoskin.formats import is_session

    if is_session(path) or path.suffix.lower() != ".npz":
        return {}
    arrays = load_arrays(path)
    if "flags" in arrays and arrays["flags"].dtype.kind not in "biuf":
        raise DataError(f"expected numbers in flags, got {arrays['flags'].dtype}", where=str(path))
    return arrays


def _ranges(given: list[str], n: int) -> list[str]:
    """(n,) state of each frame, "" without one."""
    labels = [""] * n
    for text in given:
        name, equals, span = text.partition("=")
        first, colon, last = span.partition(":")
        if not (name and equals and colon and first.isdigit() and last.isdigit()):
            raise typer.BadParameter(f'expected NAME=A:B, got "{text}"', param_hint="--state")
        start, stop = int(first), int(last)
        if not 0 <= start < stop <= n:
            raise DataError(f"expected frames within 0:{n}, got {span}", where=f"--state {name}")
        taken = sorted({labels[k] for k in range(start, stop)} - {"", name})
        if taken:
            raise DataError(
                f"frames of {span} are already {taken[0]}",
                where=f"--state {name}",
                hint="each frame shows one state",
            )
        labels[start:stop] = [name] * (stop - start)
    return labels
