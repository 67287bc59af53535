"""Import of 16-electrode tank recordings: a full 16 × 16 scan of neighbouring pairs.

EIDORS' sample recordings in the form ``v`` (n_frames, 256), ``inj`` and ``meas`` (256, 2) and
``valid`` (256,): drive-major, values on a driven electrode marked as not valid. In EIDORS'
convention the current of drive (k, k+1) enters at k+1 and leaves at k, and a pair (j, j+1)
reads φ[j] − φ[j+1], so that a homogeneous tank gives positive values.
"""

from __future__ import annotations

import numpy as np

from tomoskin.core import DataError
from tomoskin.session.archive import Arrays
from tomoskin.session.interchange import electrode_table, numbers
from tomoskin.session.recording import Recording, frame_times


def detects(arrays: Arrays) -> bool:
    """Whether the keys are those of a full-scan tank recording."""
    return set(arrays) >= {"v", "inj", "meas", "valid"}


def parse(arrays: Arrays, source: str) -> Recording:
    """Return the recording with its valid rows only."""
    voltages = np.atleast_2d(numbers(arrays, "v", source))
    valid = arrays["valid"].astype(bool)
    if valid.shape != voltages.shape[1:]:
        raise DataError(
            f"expected valid of shape {voltages.shape[1:]}, got {valid.shape}", where=source
        )
    drive = electrode_table(arrays, "inj", source)[:, ::-1]
    rate = float(arrays["fps"]) if "fps" in arrays else 1.0
    reference = numbers(arrays, "v_ref", source)[valid] if "v_ref" in arrays else None
    return Recording(
        voltages=voltages[:, valid],
        drive=drive[valid],
        measure=electrode_table(arrays, "meas", source)[valid],
        time=frame_times(len(voltages), rate),
        reference=reference,
        labels=None,
        is_change=False,
        source=source,
    )
