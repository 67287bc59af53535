"""What a skin can resolve before it is built: bounds of a press, other electrodes and patterns."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import ndtri

from tomoskin.core import FloatArray, ModelError, TomoskinError
from tomoskin.model.forward import ForwardModel
from tomoskin.model.mesh import Mesh, triangulate
from tomoskin.model.pattern import Scan
from tomoskin.model.skin import Skin
from tomoskin.sensing.fit import (
    CONTENT,
    N_PARAMETERS,
    Response,
    Whitener,
    position_bound,
    row_covariance,
    spots_of,
)
from tomoskin.sensing.segment import Region
from tomoskin.sensing.signal import Headroom, Readout


def detection_bound(response: Response, spots: FloatArray, noise: Whitener) -> FloatArray:
    """(n,) size of each spot's change in standard deviations of the noise: √(dvᵀC⁻¹dv).

    A press is found about as often as a unit normal number exceeds the threshold less this.
    """
    changes = response.changes([spot[None] for spot in spots])
    return np.asarray(np.linalg.norm(noise(changes), axis=1))


def least_content(
    response: Response, spots: FloatArray, noise: Whitener, ratio: float
) -> FloatArray:
    """(n,) m²: content of each spot at which its change is ``ratio`` deviations of the noise.

    Linear in the content, which holds for a faint spot.
    """
    return np.asarray(spots[:, CONTENT] * ratio / detection_bound(response, spots, noise))


Advance = Callable[[float, float], None]

REFERENCE_FRAMES = 20
"""Idle frames that a reference is the mean of."""

_CELLS = 1500
"""Of the mesh that voltages are computed on."""

_REACH = 0.85
"""Figures count within this part of the way from the middle to the rim."""

_FAINT = 0.05
"""Depth of the press from which the faintest is reckoned, linearly in its content."""

_AT_ONCE = 10

_MM = 1e3


@dataclass(frozen=True)
class Demand:
    """A press, and how surely it must be noticed.

    Attributes
    ----------
    radius
        Of the pressed disc, m; without it, 7.5 % of the sheet's extent.
    depth
        Part of the conductivity that it takes.
    false_alarm
        Chance that noise alone is taken for a press at a given position in one frame.
    detected
        Chance that a press is found in one frame.
    """

    radius: float | None = None
    depth: float = 0.25
    false_alarm: float = 1e-4
    detected: float = 0.95

    def __post_init__(self) -> None:
        """Check the ranges. Raises ModelError."""
        if self.radius is not None and not 0 < self.radius < math.inf:
            raise ModelError(f"expected a radius above 0, got {self.radius:g} m")
        chances = (
            ("depth", self.depth),
            ("false alarm", self.false_alarm),
            ("found", self.detected),
        )
        for name, value in chances:
            if not 0 < value < 1:
                raise ModelError(f"expected a {name} between 0 and 1, got {value:g}")
        if self.ratio <= 0:
            raise ModelError(
                "expected a probability of detection above the probability of a false alarm, "
                f"got {self.detected:g} and {self.false_alarm:g}"
            )

    @property
    def ratio(self) -> float:
        """Size of the change, in deviations of the noise, that is found so often.

        A matched filter's output is a unit normal number, shifted by that size (Kay 1998, 4.3).
        """
        return float(ndtri(self.detected) - ndtri(self.false_alarm))

    def on(self, mesh: Mesh) -> float:
        """Radius of the press on a mesh, m."""
        return self.radius or 0.075 * float(np.ptp(mesh.points, axis=0).max())


@dataclass(frozen=True, eq=False)
class ResolutionBounds:
    """The bounds of a skin at the cells of a coarse mesh.

    Attributes
    ----------
    mesh
        Coarse; its first electrode only is real.
    bound
        (n_cells, 2, 2) m², Cramér–Rao bound of the press's position, size and strength unknown.
    faintest
        (n_cells,) part of the conductivity that the faintest noticeable press takes, 1 where a
        hole would not be noticed.
    inside
        (n_cells,) whether a cell counts for the figures.
    headroom
        What the skin asks of the board; what saturates does not count.
    """

    mesh: Mesh
    bound: FloatArray
    faintest: FloatArray
    inside: FloatArray
    headroom: Headroom

    @cached_property
    def rms(self) -> FloatArray:
        """(n_cells,) m, root mean square error in both directions together; may be infinite."""
        return np.asarray(np.sqrt(np.trace(self.bound, axis1=1, axis2=2)))

    def figures(self) -> dict[str, float]:
        """Least, median, 95th percentile of rms (m), and of the faintest press the median, p95."""
        rms, faint = self.rms[self.inside], self.faintest[self.inside]
        return {
            "least_m": float(rms.min()),
            "median_m": float(np.median(rms)),
            "p95_m": float(np.percentile(rms, 95, method="nearest")),
            "faintest_median": float(np.median(faint)),
            "faintest_p95": float(np.percentile(faint, 95)),
        }


def resolution_bounds(
    skin: Skin, demand: Demand, places: int = 500, progress: Advance = lambda _done, _total: None
) -> ResolutionBounds:
    """Bounds of a press at about so many ``places`` on a skin, from one frame of its read-out.

    The noise is that of the converter
    (:data:`~tomoskin.sensing.signal.readout.CONVERSION_NOISE` and rounding, summed readings),
    shared by the rows that share a sample, and that of a reference of 20 frames. Measurements
    that saturate (:class:`~tomoskin.sensing.signal.Headroom`) tell nothing.

    Raises
    ------
    TomoskinError
        When the skin cannot be meshed or modelled, too many of its measurements saturate, or the
        demand cannot be meant.
    """
    coarse = triangulate(skin.outline, skin.arcs[:1], places)
    fine = skin.altered({"mesh": {"cells": _CELLS}}).mesh()
    model = ForwardModel(fine, skin.pattern(), skin.contact_impedance, skin.current)
    state = model.at(skin.conductivity)
    headroom = Headroom.of(skin, state)
    covariance = _covariance(skin)
    response, noise = Response(state), _noise(covariance, headroom)
    radius = demand.on(fine)
    spots = spots_of(coarse.centroids, radius, -1.0)
    area = math.pi * radius**2
    spots[:, CONTENT] = area * math.log1p(-demand.depth)  # of an even disc of that depth
    faint = spots.copy()
    faint[:, CONTENT] = area * math.log1p(-_FAINT)
    bounds, least = [], []
    for start in range(0, len(spots), _AT_ONCE):
        progress(start, len(spots))
        some = slice(start, start + _AT_ONCE)
        bounds.append(position_bound(response, spots[some], noise))
        least.append(least_content(response, faint[some], noise, demand.ratio))
    progress(len(spots), len(spots))
    faintest = -np.expm1(np.maximum(np.concatenate(least) / area, -700.0))
    inside = _inside(skin, coarse.centroids)
    return ResolutionBounds(coarse, np.concatenate(bounds), faintest, inside, headroom)


def _covariance(skin: Skin) -> FloatArray:
    """(n_meas, n_meas) V² of a frame less a reference, by the read-out alone."""
    scan = Scan.of(skin.pattern())
    sample = Readout.of(scan, skin.readout).noise / math.sqrt(2)
    return row_covariance(scan, sample) * (1 + 1 / REFERENCE_FRAMES)


def _noise(covariance: FloatArray, headroom: Headroom) -> Whitener:
    """Raises ModelError where too little is left of what the model expects."""
    excluded = headroom.saturated
    if np.count_nonzero(~excluded) < N_PARAMETERS and (problem := headroom.problem):
        raise ModelError(problem)
    noise = Whitener.of(covariance)
    return noise.without(np.eye(len(excluded))[:, excluded])


def _inside(skin: Skin, positions: FloatArray) -> FloatArray:
    region = Region.of(skin)
    return np.asarray(region.holds(region.centre + (positions - region.centre) / _REACH))


@dataclass(frozen=True, eq=False)
class Variant:
    """A skin with another number of electrodes or another pattern, or why there is none."""

    electrodes: int
    pattern: str
    skin: Skin | None
    fault: str = ""


def variants(skin: Skin, electrodes: Sequence[int], patterns: Sequence[str]) -> Iterator[Variant]:
    """Every combination, on the same sheet with the same read-out and current.

    Electrodes are spread evenly and cover together as much of the rim as those of ``skin``.
    """
    cover = skin.n_electrodes * float(skin.arcs[0].width(skin.outline))
    evenly = {"first": "90 deg", "order": "clockwise"}
    kept = {key: skin.document["electrodes"].get(key, word) for key, word in evenly.items()}
    for count in electrodes:
        layout = kept | {
            "count": count,
            "positions": None,
            "width": f"{_MM * cover / count:.6g} mm",
            "contact_impedance": f"{float(skin.contact_impedance.mean()):.9g} ohm*m",
        }
        for pattern in patterns:
            drive = {"pattern": pattern, "drive": None, "measure": None}
            try:
                yield Variant(count, pattern, skin.altered({"electrodes": layout, "drive": drive}))
            except TomoskinError as error:
                yield Variant(count, pattern, None, error.message)
