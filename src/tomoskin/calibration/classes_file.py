"""A calibration of states as a file: the labelled examples, and what they were made on.

Keys of the .npz: ``kind``, ``version``; ``dv`` (n, n_meas), ``flags`` (n, f) 0 or 1, NaN where a
frame has no label, ``session`` (n,) from 0; ``names`` (f,), ``exclusive`` 0 or 1; ``drive``,
``measure`` (n_meas, 2), ``n_electrodes``; ``skin`` identity, ``skin_name``. As with touch, what was
learnt is learnt again when the file is read.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tomoskin.calibration.calibration_file import CalibrationFile, located
from tomoskin.calibration.classes.classifier import StateClassifier
from tomoskin.calibration.classes.codes import Codes
from tomoskin.calibration.classes.examples import Examples
from tomoskin.core import (
    Arrays,
    DataError,
    load_arrays,
    pack_arrays,
    real_numbers,
    save_arrays,
    unpack_arrays,
    whole_number,
)
from tomoskin.pattern import Pattern

STATES_FILE = "states.npz"
"""Name of the calibration inside a session."""

_FILE = CalibrationFile(
    "tomoskin states calibration",
    1,
    "states",
    "states",
    frozenset({"dv", "flags", "session", "names", "exclusive"}),
)


@dataclass(frozen=True, eq=False)
class StatesCalibration:
    """A classifier with the pattern of its rows and the name of its skin ("" where none)."""

    classifier: StateClassifier
    pattern: Pattern
    skin_name: str = ""


def write_states(path: Path, calibration: StatesCalibration, *, overwrite: bool = False) -> None:
    """Write the file; raises as :func:`written` does."""
    save_arrays(path, _arrays(calibration), overwrite=overwrite)


def pack_states(calibration: StatesCalibration) -> bytes:
    """The same file's bytes, for a session that holds it."""
    return pack_arrays(_arrays(calibration))


def _arrays(calibration: StatesCalibration) -> Arrays:
    classifier, pattern = calibration.classifier, calibration.pattern
    examples = classifier.examples
    return _FILE.header(pattern, calibration.skin_name) | {
        "dv": examples.dv,
        "flags": examples.flags,
        "session": examples.session,
        "names": np.array(examples.codes.names),
        "exclusive": np.array(int(examples.codes.exclusive)),
        "skin": np.array(classifier.skin_id),
    }


def read_states(path: Path) -> StatesCalibration:
    """Read the file and learn from its examples again.

    Raises
    ------
    DataError
        When it is missing, damaged, or no calibration of states.
    """
    return _read(load_arrays(path), str(path))


def unpack_states(data: bytes, where: str) -> StatesCalibration:
    """:func:`read_states` from the file's bytes."""
    return _read(unpack_arrays(data, where), where)


def _read(arrays: Arrays, where: str) -> StatesCalibration:
    pattern = _FILE.pattern(arrays, where)
    with located(where):
        examples = _examples(arrays, where)
        if examples.dv.shape[1] != pattern.n_meas:
            raise DataError(f"expected {pattern.n_meas} rows of dv")
        identities = (pattern.identity, str(arrays.get("skin", "")))
        classifier = StateClassifier.learn(examples, identities)
    return StatesCalibration(classifier, pattern, str(arrays.get("skin_name", "")))


def _examples(arrays: Arrays, where: str) -> Examples:
    exclusive = bool(whole_number(arrays, "exclusive", where))
    codes = Codes(tuple(map(str, arrays["names"].ravel().tolist())), exclusive)
    examples = Examples.of(
        codes, real_numbers(arrays, "dv", where), real_numbers(arrays, "flags", where)
    )
    session = real_numbers(arrays, "session", where)
    if session.shape != (len(examples),) or not np.isin(session, range(1000)).all():
        raise DataError(f"expected a session from 0 for each of {len(examples)} frames")
    return replace(examples, session=session.astype(np.int64))
