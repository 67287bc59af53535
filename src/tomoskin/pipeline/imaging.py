"""Difference data → image and its noise floor; and what of a change the image leaves open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial

import numpy as np

from tomoskin.core import FloatArray, Image, IntArray, ModelError
from tomoskin.imaging import Modes, Temporal, unresolved
from tomoskin.pipeline.prepare import Prepared
from tomoskin.sensing.fit import SpotPrior
from tomoskin.sensing.segment import ImageNoise
from tomoskin.sensing.signal import NuisanceSubspace, Reference

NoiseOfImage = Callable[[], ImageNoise | None]
"""Computes the noise floor of an image when somebody asks; None where the noise is not known."""

ImageAndNoise = tuple[Image, NoiseOfImage]
"""An image, and its noise floor."""

_SETTLED = 3.0
"""Time constants after which the filter's noise is the one of all time."""

_GAP = 2.5
"""Frames that are further apart than so many intervals start the filter's noise anew."""


class SingleFrame:
    """Each image from its own frame, computed where somebody looks at it."""

    def __init__(
        self,
        prepared: Prepared,
        reference: Reference | None,
        subspace: NuisanceSubspace | None = None,
    ) -> None:
        self._operator = prepared.operator
        self._noise: NoiseOfImage = lambda: None
        if reference is not None:
            self.renew(prepared, reference, subspace)

    def renew(
        self, prepared: Prepared, reference: Reference, subspace: NuisanceSubspace | None
    ) -> None:
        """Another operator or noise, or other directions of the data that say nothing."""
        self._operator = prepared.operator
        # regions of the image ask for it, fitted touches never
        self._noise = cache(partial(prepared.image_noise, reference, subspace))

    def push(self, dv: FloatArray, time: float) -> ImageAndNoise:
        """Image of ``dv`` (n_meas,), measured at ``time`` s. Raises DataError for other data."""
        del time
        return self._operator.deferred(dv), self._noise


class Filtered:
    """Images that rest on the frames before them too; see :class:`Temporal`.

    Times may have gaps: the filter forgets as much as has passed. Where they do not go on, as
    when a board starts again, it begins anew.

    Parameters
    ----------
    interval
        Of the frames, s, as a rule; NaN where it is not known.
    """

    def __init__(
        self,
        prepared: Prepared,
        modes: Modes,
        reference: Reference | None,
        interval: float,
        subspace: NuisanceSubspace | None = None,
    ) -> None:
        self._temporal = Temporal(modes, prepared.skin.inverse.time_constant)
        self._interval = interval
        self._settled = np.inf
        self._noise: FloatArray | None = None
        self._alone: ImageNoise | None = None
        if reference is not None:
            self.renew(prepared, reference, subspace)

    def renew(
        self, prepared: Prepared, reference: Reference, subspace: NuisanceSubspace | None
    ) -> None:
        """As :meth:`SingleFrame.renew`, but for the operator: the modes stay."""
        if not reference.noise_is_known:
            return
        noise = prepared.difference_noise(reference)
        self._noise = noise if subspace is None else subspace.projected(np.eye(len(noise))) * noise
        self._alone = prepared.image_noise(reference, subspace)
        for name in ("_steady", "_settling"):
            self.__dict__.pop(name, None)

    def push(self, dv: FloatArray, time: float) -> ImageAndNoise:
        """As :meth:`SingleFrame.push`."""
        last = self._temporal.belief
        if last is not None and not time > last.time:
            self._temporal.reset()
            last = None
        if last is None or time - last.time > _GAP * self._interval:
            self._settled = time + _SETTLED * self._temporal.time_constant
        return self._temporal.push(dv, time), partial(self._image_noise, time)

    def _image_noise(self, time: float) -> ImageNoise | None:
        """The filter's own; until that holds, no less than that of a single frame."""
        if self._alone is None or self._steady is None:
            return self._alone
        if time >= self._settled:
            return self._steady
        return self._settling

    @cached_property
    def _steady(self) -> ImageNoise | None:
        if self._noise is None or not self._interval > 0:
            return None
        spread = self._temporal.spread(self._noise, self._interval)
        return ImageNoise.of(spread, self._temporal.modes.operator.model.mesh.identity)

    @cached_property
    def _settling(self) -> ImageNoise | None:
        if self._alone is None or self._steady is None:
            return self._alone
        return replace(self._alone, sd=np.maximum(self._alone.sd, self._steady.sd))


@dataclass(frozen=True, eq=False)
class Unresolved:
    """One map for all frames of a skin with the same alpha and the same measurements.

    Attributes
    ----------
    values
        (n_cells,) from 0, all is told, to 1, nothing is; see :func:`tomoskin.imaging.unresolved`.
    radius
        Of the disc about each cell, m: that of a usual touch.
    """

    values: FloatArray
    radius: float

    @classmethod
    def of(cls, prepared: Prepared, alpha: float, excluded: IntArray) -> Unresolved:
        """Of an image by ``alpha`` without the measurements ``excluded``.

        Raises
        ------
        ModelError
            For a trained operator, which stands for no prior.
        DataError
            When too few measurements are left.
        """
        if prepared.skin.inverse.method != "one-step":
            raise ModelError(
                "a trained operator has no prior, so what it leaves open is not known",
                hint='set method = "one-step" in [inverse]',
            )
        operator = prepared.problem.operator(alpha).without(np.asarray(excluded))
        radius = SpotPrior.of(prepared.mesh).radius
        return cls(unresolved(operator, prepared.problem, alpha, radius), radius)
