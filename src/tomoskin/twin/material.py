"""The sheet's conductivity: from strain, compression, their past, temperature and wear."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from tomoskin.core import FloatArray, ModelError
from tomoskin.twin.dent import Load
from tomoskin.twin.parameters import check_numbers, parameter

_MOST_COMPRESSION = 0.99
_MOST_LOG = 12.0
"""A conductivity leaves its value at rest by at most e to this: a needle must not cut the sheet."""


@dataclass(frozen=True, slots=True)
class MaterialSettings:
    """How a sheet conducts; the defaults are a sheet without memory."""

    gauge: float = parameter(
        10.0, "", "Relative rise of resistance per mean strain in the plane.", "assumed"
    )
    gauge_across: float = parameter(
        0.0, "", "The same for the strain's deviator: conduction differs by direction.", "assumed"
    )
    compression: float = parameter(
        0.0, "", "Relative rise of conductivity per compression of what lies under it.", "assumed"
    )
    thickness: float = parameter(
        3e-3, "m", "What a depth is divided by to give that compression.", "assumed"
    )
    creep: tuple[float, ...] = parameter(
        (), "", "Parts of the response that come late (Prony series).", "assumed"
    )
    creep_times: tuple[float, ...] = parameter((), "s", "Time constants of these parts.", "assumed")
    play: tuple[float, ...] = parameter(
        (), "", "Parts of the response that lag behind by a play (Prandtl, Ishlinskii).", "assumed"
    )
    play_widths: tuple[float, ...] = parameter((), "", "Half widths of these plays.", "assumed")
    temperature_coefficient: float = parameter(
        0.0, "1/K", "Relative rise of resistance per kelvin.", "assumed"
    )
    temperature_sd: float = parameter(
        0.0, "K", "Standard deviation of the sheet's temperature over time.", "assumed"
    )
    temperature_time: float = parameter(600.0, "s", "Correlation time of that.", "assumed")
    spread: float = parameter(
        0.0, "", "Standard deviation of the logarithm of conductivity over the sheet.", "assumed"
    )
    spread_length: float = parameter(20e-3, "m", "Correlation length of that.", "assumed")
    wear: float = parameter(
        0.0, "", "Relative loss of conductivity per strain, summed over all loading.", "assumed"
    )

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_numbers(
            self,
            above="thickness temperature_time spread_length",
            least="temperature_sd spread wear",
        )
        for parts, sizes in (("creep", "creep_times"), ("play", "play_widths")):
            self._check_series(parts, sizes)

    def _check_series(self, parts: str, sizes: str) -> None:
        weights, lengths = getattr(self, parts), getattr(self, sizes)
        where = "MaterialSettings"
        if len(weights) != len(lengths):
            raise ModelError(f"expected as many {parts} as {sizes}", where=where)
        if not all(0 < length < math.inf for length in lengths):
            raise ModelError(f"expected {sizes} above 0, got {lengths}", where=where)
        if not (all(w >= 0 for w in weights) and sum(weights) <= 1):
            raise ModelError(f"expected {parts} from 0 to a sum of 1, got {weights}", where=where)

    @property
    def scalar(self) -> bool:
        """Whether the sheet conducts alike in all directions."""
        return self.gauge_across == 0

    @property
    def still(self) -> bool:
        """Whether time alone changes nothing."""
        return not self.creep and self.temperature_sd == 0


@dataclass(frozen=True, eq=False)
class MaterialState:
    """What the sheet remembers.

    Attributes
    ----------
    felt
        (n, 4) strain xx, yy, xy and compression as the load was last.
    late
        (n_creep, n, 4) what each late part has reached.
    lagging
        (n_play, n, 4) where each play stands.
    worn
        (n,) mean strain, summed over all loading.
    warmer
        K above the temperature of the unloaded sheet's conductivity.
    """

    felt: FloatArray
    late: FloatArray
    lagging: FloatArray
    worn: FloatArray
    warmer: float = 0.0

    @classmethod
    def fresh(cls, settings: MaterialSettings, n: int) -> MaterialState:
        """A sheet of ``n`` cells that nothing has touched."""
        return cls(
            felt=np.zeros((n, 4)),
            late=np.zeros((len(settings.creep), n, 4)),
            lagging=np.zeros((len(settings.play), n, 4)),
            worn=np.zeros(n),
        )


def advance(
    state: MaterialState,
    settings: MaterialSettings,
    load: Load,
    dt: float,
    chance: float = 0.0,
) -> MaterialState:
    """The state after the load has stood for ``dt`` s; exact for any length of the step.

    The load is taken to jump at the start of the step. ``chance`` is a standard normal number
    for the temperature (Ornstein & Uhlenbeck; Gillespie 1996, Phys. Rev. E 54, 2084, eq. 2.47).

    Raises
    ------
    ModelError
        When dt is negative or not finite.
    """
    if not 0 <= dt < math.inf:
        raise ModelError(f"expected a time step of 0 s or more, got {dt}", where="twin")
    felt = _felt(load, settings)
    state = replace(
        state,
        felt=felt,
        lagging=_pulled(state.lagging, felt, settings),
        worn=_worn(state, felt, settings),
    )
    return replace(
        state,
        late=_crept(state, settings, dt),
        warmer=_warmed(state.warmer, settings, dt, chance),
    )


def conductivity(
    state: MaterialState, settings: MaterialSettings, unloaded: FloatArray
) -> FloatArray:
    """(n_cells,) S, or (n_cells, 2, 2) where directions differ.

    σ = σ₀ · (1 + c·compression) · exp(−wear) / (1 + α ΔT) · exp(−g·mean strain) ·
    exp(−g_across · deviator), the last a matrix exponential: positive at any strain, and the
    gauge factors' straight line near none.

    Parameters
    ----------
    unloaded
        (n_cells,) S.
    """
    strain = _effective(state, settings)
    mean = (strain[:, 0] + strain[:, 1]) / 2
    squeezed = np.clip(strain[:, 3], -_MOST_COMPRESSION, _MOST_COMPRESSION)
    exponent = np.clip(-settings.gauge * mean - settings.wear * state.worn, -_MOST_LOG, _MOST_LOG)
    sigma = unloaded * np.exp(exponent) * np.maximum(1 + settings.compression * squeezed, 1e-3)
    sigma /= max(1 + settings.temperature_coefficient * state.warmer, 1e-3)
    if settings.scalar:
        return np.asarray(sigma)
    return np.asarray(sigma[:, None, None] * _directed(strain, settings.gauge_across))


def _felt(load: Load, settings: MaterialSettings) -> FloatArray:
    return np.column_stack([load.strain, load.depth / settings.thickness])


def _effective(state: MaterialState, settings: MaterialSettings) -> FloatArray:
    """(n, 4): what is felt at once, and the late parts."""
    total = (1 - sum(settings.creep)) * _lagged(state, settings)
    for part, late in zip(settings.creep, state.late, strict=True):
        total += part * late
    return np.asarray(total)


def _lagged(state: MaterialState, settings: MaterialSettings) -> FloatArray:
    """(n, 4): the load with its plays."""
    total = (1 - sum(settings.play)) * state.felt
    for part, lagging in zip(settings.play, state.lagging, strict=True):
        total += part * lagging
    return np.asarray(total)


def _pulled(lagging: FloatArray, felt: FloatArray, settings: MaterialSettings) -> FloatArray:
    """Each play is pulled along at its ends (Krasnosel'skii & Pokrovskii 1989, chapter 1).

    The strain as a whole, whatever its direction: its size is √((xx² + yy² + 2xy²)/2), the mean
    strain where both directions are strained alike. Compression has a play of its own.
    """
    if not settings.play:
        return lagging
    slack = lagging - felt
    size = np.sqrt(slack**2 @ np.array([[0.5, 0], [0.5, 0], [1.0, 0], [0, 1.0]]))
    width = np.array(settings.play_widths).reshape(-1, 1, 1)
    kept = width / np.maximum(size, width)
    return np.asarray(felt + slack * kept[..., [0, 0, 0, 1]])


def _crept(state: MaterialState, settings: MaterialSettings, dt: float) -> FloatArray:
    """q' = (s − q)/τ with s held: q → s + (q − s) exp(−dt/τ)."""
    if not settings.creep:
        return state.late
    target = _lagged(state, settings)
    kept = np.exp(-dt / np.array(settings.creep_times)).reshape(-1, 1, 1)
    return np.asarray(target + (state.late - target) * kept)


def _worn(state: MaterialState, felt: FloatArray, settings: MaterialSettings) -> FloatArray:
    if settings.wear == 0:
        return state.worn
    before = state.felt
    rise = (felt[:, 0] + felt[:, 1] - before[:, 0] - before[:, 1]) / 2
    return np.asarray(state.worn + np.maximum(rise, 0.0))


def _warmed(warmer: float, settings: MaterialSettings, dt: float, chance: float) -> float:
    if settings.temperature_sd == 0:
        return warmer
    kept = math.exp(-dt / settings.temperature_time)
    return warmer * kept + settings.temperature_sd * math.sqrt(1 - kept**2) * chance


def _directed(strain: FloatArray, gauge: float) -> FloatArray:
    """(n, 2, 2) exp(−gauge · deviator): cosh d − sinh(d)/d · gauge · deviator."""
    half = gauge * (strain[:, 0] - strain[:, 1]) / 2
    cross = gauge * strain[:, 2]
    size = np.hypot(half, cross)
    size[size < 1e-12] = 1e-12  # sinh(d)/d is 1 there
    grown = np.expm1(np.minimum(size, _MOST_LOG))
    shrunk = grown / (1 + grown)  # 1 − e⁻ᵈ
    cosh, sinhc = 1 + (grown - shrunk) / 2, (grown + shrunk) / (2 * size)
    tensor = np.empty((len(strain), 2, 2))
    tensor[:, 0, 0], tensor[:, 1, 1] = cosh - sinhc * half, cosh + sinhc * half
    tensor[:, 0, 1] = tensor[:, 1, 0] = -sinhc * cross
    return tensor


def spread_over(
    settings: MaterialSettings, points: FloatArray, random: np.random.Generator
) -> FloatArray:
    """(n,) factors on the conductivity at ``points`` (n, 2): a log-normal field, 1 in the mean.

    Its logarithm is Gaussian with covariance spread² · exp(−r²/2L²), as a sum of many waves of
    random direction and phase (Shinozuka & Deodatis 1991, Appl. Mech. Rev. 44, 191).
    """
    waves = random.standard_normal((512, 2)) / settings.spread_length
    phase = random.uniform(0, 2 * np.pi, 512)
    if settings.spread == 0:
        return np.ones(len(points))
    field = np.cos(points @ waves.T + phase).sum(axis=1) * math.sqrt(2 / 512)
    return np.asarray(np.exp(settings.spread * field - settings.spread**2 / 2))
