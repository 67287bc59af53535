"""Pictures of the experiments: one step, regions above a threshold, the thesis's metrics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tomoskin.core import Detection, FloatArray, Image
from tomoskin.extras.greit import ThesisMetrics
from tomoskin.model.skin import Skin
from tomoskin.pipeline import prepare, reconstruct
from tomoskin.sensing.segment import Segmenter
from tomoskin.sensing.signal import Recording, difference

NOSER = {"inverse": {"prior": "noser", "difference": "normalised", "alpha": "auto"}}
"""The thesis's inverse: NOSER's prior, one step, normalised differences; alpha by the noise."""


FRAMES = 40
"""Frames of a stage where pictures are compared: four times the thesis's, for half the noise."""

PERIOD = 0.06
"""s from one frame to the next, about that of a Mega with 8 electrodes."""


class Imager:
    """Pictures of a skin: a loaded stage against an idle one."""

    def __init__(self, skin: Skin) -> None:
        self.prepared = prepare(skin)
        self.mesh = self.prepared.mesh

    def picture(self, idle: FloatArray, loaded: FloatArray) -> Image:
        """Change of conductivity from the mean of ``idle`` to that of ``loaded`` (n, n_meas) V."""
        reference = idle.mean(axis=0)
        kind = self.prepared.operator.difference
        return self.prepared.operator(difference(loaded.mean(axis=0), reference, kind))

    def regions(self, image: Image, part: float) -> list[Detection]:
        """Regions above ``part`` of the extreme, as the thesis finds them (its figure 4.6)."""
        settings = replace(self.prepared.skin.touch, gamma1=part)
        return Segmenter(self.mesh, settings)(image)

    def touches(self, idle: FloatArray, loaded: FloatArray) -> list[Detection]:
        """Touches fitted to the voltages, as a live run has them in the last of the frames."""
        prepared, pattern = prepare(Skin.load(self.prepared.skin.name)), self.prepared.pattern
        time = PERIOD * np.arange(len(loaded))
        rows = pattern.drive, pattern.measure, time
        recording = Recording(loaded, *rows, None, None, is_change=False, source="the stage")
        return [touch.detection for touch in reconstruct(prepared, recording, idle).touches[-1]]

    def metrics(self, image: Image, place: tuple[float, float] | None = None) -> ThesisMetrics:
        """The thesis's four metrics (its section 4.4.1), the true place known or not."""
        return ThesisMetrics.of(image, self.mesh, place)


def named_metrics(name: str, metrics: ThesisMetrics) -> dict[str, float]:
    """The four metrics as numbers of a report."""
    return {
        f"{name}: maximum, S": metrics.maximum,
        f"{name}: RES50": metrics.res50,
        f"{name}: RES75": metrics.res75,
        f"{name}: shape angle, deg": float(np.degrees(metrics.shape_angle)),
        f"{name}: ERR75, mm": 1e3 * metrics.error75,
    }
