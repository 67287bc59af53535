"""A recording's images with edges, by total variation, in place of its smooth ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.extras.absolute.absolute import SharpDifference
from tomoskin.extras.absolute.unknowns import Observation
from tomoskin.model.prior import TotalVariation
from tomoskin.pipeline import Idle, Prepared, Reconstruction, recorded_frames
from tomoskin.sensing.signal import Recording

_NOTHING = 1e-12
"""Part of the largest power below which a sum of measurements says nothing."""


def sharpened(
    result: Reconstruction,
    prepared: Prepared,
    recording: Recording,
    idle: Idle,
    advance: Callable[[int, int], None] = lambda _done, _total: None,
) -> Reconstruction:
    """``result`` with images by total variation in place of its own; all else stays.

    What the smooth image of the frame that changes most leaves of its data, up to a factor on it,
    counts as noise. Alpha is the one at which that frame's sharp image leaves as much. The images
    are in S, or S/m.
    """
    recorded = recorded_frames(prepared, recording, idle)
    rows = np.searchsorted(recorded.frames, result.frames)
    problem, changes = recorded.prepared.problem, recorded.differences[rows]
    size = np.abs(problem.reference) if problem.difference == "normalised" else 1.0
    changes, jacobian = changes * size, problem.jacobian * np.reshape(size, (-1, 1))
    missing = recorded.missing[rows]
    strongest = int(np.linalg.norm(changes, axis=1).argmax())
    noise = _left_over(changes[strongest], jacobian @ result.images[strongest])
    reach = _reach(jacobian)
    method = SharpDifference(
        problem.model, TotalVariation(), conductivity=prepared.skin.conductivity
    )
    shown = []
    order = [strongest, *(k for k in range(len(rows)) if k != strongest)]
    for done, k in enumerate(order, start=1):
        if missing[k].any():
            given = Observation.of(changes[k], np.where(missing[k], np.inf, noise))
        else:
            given = Observation(reach @ changes[k], np.full(len(reach), noise), reach)
        sharp = method(given)
        method.alpha = sharp.alpha
        shown.append(sharp.image)
        advance(done, len(rows))
    in_order = tuple(shown[number] for number in np.argsort(order))
    return replace(result, shown=in_order, unit=shown[0].unit)


def _reach(jacobian: FloatArray) -> FloatArray:
    """(k, n_meas) orthonormal: the sums of measurements that images change at all.

    Of many measurements most are sums of others: 120 independent ones of 16 electrodes.
    """
    power, basis = np.linalg.eigh(jacobian @ jacobian.T)
    return np.asarray(basis[:, power > _NOTHING * power[-1]].T)


def _left_over(data: FloatArray, explained: FloatArray) -> float:
    """Rms of what data (n_meas,) V keep without their part along what an image explains."""
    power = float(explained @ explained)
    rest = data - (data @ explained / power if power else 0.0) * explained
    return max(float(np.sqrt(np.mean(rest**2))), 1e-9 * float(np.abs(data).max()), 1e-300)
