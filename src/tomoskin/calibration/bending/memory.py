"""What a sheet remembers of a bend, undone: from amplitudes in time to what they are made of."""

from __future__ import annotations

import numpy as np

from tomoskin.core import FloatArray

_WIDTHS = (0.03, 0.08, 0.16, 0.3)
"""Half widths of the plays, in parts of the largest amplitude."""

_LAGS = (1.0, 30.0)
"""Time constants of what comes late, s."""


class Memory:
    """Features of mode amplitudes z: themselves, bent, and where ``remembers`` their past.

    The inverse of a sum of plays is a sum of plays again (Krejčí & Kuhnen 2001, IEE Proc. Control
    Theory Appl. 148, 185), so an angle is sought as a linear function of z, of z·|z|, of plays of
    z and of z as it comes through low passes.

    Parameters
    ----------
    size
        Largest amplitude that was learnt from.
    plays
        Where the plays stand at the reference, as :meth:`plays_after` gives them; without it, in
        the middle, as in a sheet that has never been bent.
    """

    def __init__(
        self, n_modes: int, size: float, *, remembers: bool, plays: FloatArray | None = None
    ) -> None:
        self._size, self._remembers = size, remembers
        self._plays = np.zeros((len(_WIDTHS), n_modes)) if plays is None else plays
        self._late = np.zeros((len(_LAGS), n_modes))
        self._time: float | None = None

    def push(self, z: FloatArray, time: float) -> FloatArray:
        """(f,) features of amplitudes ``z`` (k,) at ``time`` s; frames in order."""
        step = 0.0 if self._time is None else max(time - self._time, 0.0)
        self._time = time
        curved = z * np.linalg.norm(z) / self._size
        if not self._remembers:
            return np.concatenate([z, curved])
        width = self._size * np.array(_WIDTHS)[:, None]
        self._plays = np.clip(self._plays, z - width, z + width)
        left = np.exp(-step / np.array(_LAGS))[:, None]
        self._late = z + (self._late - z) * left
        lead = slice(0, min(3, len(z)))  # what is small has no past to speak of
        past = (self._plays[:, lead].ravel(), self._late[:, lead].ravel())
        return np.concatenate([z, curved, *past])

    @classmethod
    def over(
        cls,
        z: FloatArray,
        time: FloatArray,
        size: float,
        *,
        remembers: bool,
        plays: FloatArray | None = None,
    ) -> FloatArray:
        """(n, f) features of a whole recording, from its rest on."""
        memory = cls(z.shape[1], size, remembers=remembers, plays=plays)
        return np.array([memory.push(row, float(t)) for row, t in zip(z, time, strict=True)])

    @classmethod
    def plays_after(cls, z: FloatArray, size: float) -> FloatArray:
        """(w, k) where the plays stand once a sheet has been through ``z`` (n, k) and is back."""
        memory = cls(z.shape[1], size, remembers=True)
        for row in (*z, np.zeros(z.shape[1])):
            memory.push(row, 0.0)
        return memory._plays
