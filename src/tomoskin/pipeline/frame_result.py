"""What comes out of the frame flow: one frame, all the way to touches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from tomoskin.core import FloatArray, Image, Touch, Voltages
from tomoskin.learning import TOUCH, CalibrationHealth, Reading
from tomoskin.pipeline.diagnosis import (
    Cause,
    Diagnosis,
    likeliest,
    of_deformation,
    of_measurements,
)
from tomoskin.sensing.fit import Deformation
from tomoskin.sensing.signal import BaselineState, Health
from tomoskin.sensing.track import TouchEvent

REFUSED = 0.3
DOUBTED = 0.8
"""Cosine below which a recording is refused as another skin's, and below which it is doubted. Real
recordings with the right skin have 0.33 to 0.998; another shape or order 0.73 to −0.1."""

_MOST_SIZE = 3.0
"""Voltages in V are doubted where they differ from the model's by more than this factor: a skin of
the same pattern and another resistance or current shows in nothing else."""


@dataclass(frozen=True, slots=True)
class ModelAgreement:
    """A reference beside the voltages that a skin's model expects; NaN where there is none.

    Attributes
    ----------
    cosine
        Of the angle between them: 1 where they are proportional.
    size
        Norm of the reference as a part of the model's.
    """

    cosine: float = math.nan
    size: float = math.nan

    @classmethod
    def of(cls, reference: FloatArray, model: FloatArray) -> Self:
        """The agreement of two vectors (n_meas,) of voltages."""
        length, expected = float(np.linalg.norm(reference)), float(np.linalg.norm(model))
        if not length or not expected:
            return cls(0.0, length / expected if expected else 0.0)
        return cls(float(reference @ model) / (length * expected), length / expected)

    @property
    def text(self) -> str:
        """The agreement as one sentence for people."""
        return (
            f"the reference agrees with the skin's model by {self.cosine:.3f} (1 = "
            f"proportional), at {self.size:.3g} times its size"
        )

    def doubt(self, *, volts: bool) -> str | None:
        """What to look at, in a sentence, or None; ``volts``: whether the size can be meant."""
        if math.isnan(self.cosine):  # there is no reference yet
            return None
        if self.cosine < DOUBTED:
            return f"{self.text}: check the skin and the order of the electrodes"
        if volts and not 1 / _MOST_SIZE < self.size < _MOST_SIZE:
            return f"{self.text}: check the skin, its current and its sheet resistance"
        return None


NO_AGREEMENT = ModelAgreement()
"""Where there is no reference."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameResult:
    """One frame from voltages to touches.

    Attributes
    ----------
    sequence, host_time, scanned, scan_time
        As in the voltages that it was made from.
    ready
        Whether a reference stands; until then the image is zero and there are no touches.
    has_image
        Whether enough rows were usable; where not, the image is zero and there are no touches.
    image
        Change of conductivity against the reference.
    voltages, reference
        (n_meas,) V; where no reference stands yet, that of the model.
    touches
        Tracked touches.
    left_out
        Number of rows that were at a rail or not finite and were left out of the picture.
    events
        What happened to the touches in this frame.
    health, baseline
        Of the electrodes, and of the reference that the frame was held against; None until
        that stands.
    readings
        What the skin's calibrations read in it, by the name of their kind.
    diagnoses
        What may be the matter beside electrodes, a deformation and a stale reference.
    calibrated
        Names of the kinds of calibrations in use.
    deformation
        How the sheet is deformed as a whole, though nothing was taught; None where it is not.
    """

    sequence: int
    host_time: float
    ready: bool
    has_image: bool
    image: Image
    voltages: FloatArray
    reference: FloatArray
    touches: tuple[Touch, ...]
    left_out: int
    events: tuple[TouchEvent, ...] = ()
    health: Health | None = None
    baseline: BaselineState | None = None
    readings: Mapping[str, Any] = field(default_factory=dict)
    diagnoses: tuple[Diagnosis, ...] = ()
    calibrated: frozenset[str] = frozenset()
    deformation: Deformation | None = None
    scanned: float = math.nan
    scan_time: float = math.nan

    @classmethod
    def at_rest(
        cls,
        measured: Voltages,
        image: Image,
        reference: FloatArray,
        baseline: BaselineState | None = None,
    ) -> Self:
        """Of a frame that the reference is collected from; ``baseline`` once that stands."""
        return cls(
            sequence=measured.sequence,
            host_time=measured.host_time,
            ready=baseline is not None,
            has_image=True,
            image=image,
            voltages=measured.values,
            reference=reference,
            touches=(),
            left_out=int(np.count_nonzero(measured.excluded)),
            baseline=baseline,
            scanned=measured.scanned,
            scan_time=measured.scan_time,
        )

    @property
    def shown_readings(self) -> dict[str, Reading]:
        """Those of the readings that are shown, by the name of their kind."""
        every = self.readings.items()
        return {kind: reading for kind, reading in every if isinstance(reading, Reading)}

    @property
    def calibration(self) -> CalibrationHealth | None:
        """How touches fit the calibration that locates them; None where none does."""
        return self.readings.get(TOUCH.name)

    @property
    def diagnosis(self) -> Diagnosis | None:
        """What is likely the matter, or None."""
        stale = self.baseline.stale if self.baseline else None
        return likeliest(
            (
                of_measurements(
                    self.health, self.left_out, len(self.voltages), has_image=self.has_image
                ),
                *self.diagnoses,
                of_deformation(self.deformation),
                None if stale is None else Diagnosis(Cause.STALE, stale),
            )
        )

    @property
    def problem(self) -> str | None:
        """What is likely the matter, in a sentence that says what to do next, or None."""
        diagnosis = self.diagnosis
        return None if diagnosis is None else diagnosis.text


@dataclass(frozen=True, slots=True)
class ReferenceState:
    """How far the reference is: frames taken of those needed, when it was done, its noise in V,
    what has become of it since, and how well it agrees with the model."""

    frames: int
    needed: int
    since: float | None = None
    noise: float | None = None
    baseline: BaselineState | None = None
    agreement: ModelAgreement = NO_AGREEMENT

    @property
    def ready(self) -> bool:
        """Whether there is a reference to follow frames with."""
        return self.since is not None
