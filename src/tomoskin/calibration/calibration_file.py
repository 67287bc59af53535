"""What the files of all calibrations have in common: what they are, and of which rows and skin."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from tomoskin.core import Arrays, DataError, ModelError, PatternError, electrode_table, whole_number
from tomoskin.pattern import Pattern


@dataclass(frozen=True)
class CalibrationFile:
    """One sort of calibration.

    Attributes
    ----------
    kind, version
        What the file says that it is.
    of
        What it calibrates, for messages.
    command
        The sub-command of ``tomoskin calibrate`` that makes one.
    needed
        Keys that it must have beside those of its rows.
    """

    kind: str
    version: int
    of: str
    command: str
    needed: frozenset[str]

    def header(self, pattern: Pattern, skin_name: str) -> Arrays:
        """What the file begins with."""
        return {
            "kind": np.array(self.kind),
            "version": np.array(self.version),
            "drive": pattern.drive,
            "measure": pattern.measure,
            "n_electrodes": np.array(pattern.n_electrodes),
            "skin_name": np.array(skin_name),
        }

    def pattern(self, arrays: Arrays, where: str) -> Pattern:
        """The table of rows of a file. Raises DataError when it is no such calibration."""
        rows = {"version", "drive", "measure", "n_electrodes"}
        if str(arrays.get("kind", "")) != self.kind or not set(arrays) >= self.needed | rows:
            raise DataError(
                f"is not a calibration of {self.of}",
                where=where,
                hint=f"make one: tomoskin calibrate {self.command}",
            )
        if whole_number(arrays, "version", where) != self.version:
            raise DataError(
                f"expected version {self.version}, got {arrays['version']}", where=where
            )
        drive, measure = (electrode_table(arrays, key, where) for key in ("drive", "measure"))
        with located(where):
            return Pattern.from_tables(drive, measure, whole_number(arrays, "n_electrodes", where))


@contextmanager
def located(where: str) -> Iterator[None]:
    """Name the file in errors of what is made from its arrays, as DataError."""
    try:
        yield
    except (DataError, ModelError, PatternError) as error:
        raise DataError(error.message, where=f"{where}, {error.where}".rstrip(", ")) from error
