"""The sheet's conductivity: from strain, compression, their past, temperature and wear."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from tomoskin.core import FloatArray
from tomoskin.model import skin
from tomoskin.model.forward import choose_engine
from tomoskin.twin.parameters import check_numbers, parameter, wandered

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
        0.0,
        "",
        "The same for the deviator of the strain: conductivity then differs by direction.",
        "assumed",
    )
    compression: float = parameter(
        0.0,
        "",
        "Relative rise of conductivity per compression of the layer under the sheet.",
        "assumed",
    )
    thickness: float = parameter(
        3e-3, "m", "Thickness by which a depth is divided to give that compression.", "assumed"
    )
    creep: tuple[float, ...] = parameter(
        (), "", "Fractions of the response that come late (Prony series).", "assumed"
    )
    creep_times: tuple[float, ...] = parameter(
        (), "s", "Time constants of these fractions.", "assumed"
    )
    play: tuple[float, ...] = parameter(
        (),
        "",
        "Fractions of the response that lag behind by a play (Prandtl, Ishlinskii).",
        "assumed",
    )
    play_widths: tuple[float, ...] = parameter((), "", "Half widths of these plays.", "assumed")
    temperature_coefficient: float = parameter(
        0.0, "1/K", "Relative rise of resistance per kelvin.", "assumed"
    )
    temperature_sd: float = parameter(
        0.0, "K", "Standard deviation of the sheet's temperature over time.", "assumed"
    )
    temperature_time: float = parameter(
        600.0, "s", "Correlation time of the temperature.", "assumed"
    )
    spread: float = parameter(
        0.0, "", "Standard deviation of the logarithm of conductivity over the sheet.", "assumed"
    )
    spread_length: float = parameter(20e-3, "m", "Correlation length of that logarithm.", "assumed")
    wear: float = parameter(
        0.0, "", "Relative loss of conductivity per strain, summed over all loading.", "assumed"
    )

    breakdown: tuple[float, ...] = parameter(
        (), "", "Responses to motion of the load, in both directions: contacts break.", "assumed"
    )
    breakdown_times: tuple[float, ...] = parameter(
        (), "s", "Time constants with which the contacts form again.", "assumed"
    )

    def __post_init__(self) -> None:
        """Check that every number is in its range."""
        check_numbers(
            self,
            above="thickness temperature_time spread_length",
            least="temperature_sd spread wear",
        )
        _ = self.memory  # checks its own

    @property
    def memory(self) -> skin.MaterialMemory:
        """What the sheet remembers, of strain and of compression alike."""
        return _memory(
            self.play,
            self.play_widths,
            self.creep,
            self.creep_times,
            self.breakdown,
            self.breakdown_times,
        )

    @property
    def scalar(self) -> bool:
        """Whether the sheet conducts alike in all directions."""
        return self.gauge_across == 0

    @property
    def still(self) -> bool:
        """Whether time alone changes nothing."""
        return self.memory.still and self.temperature_sd == 0


_memory = lru_cache(maxsize=64)(skin.MaterialMemory)
"""The same for the same series: it is asked for several times a frame, and checks its numbers."""


@lru_cache(maxsize=64)
def metric_of(thickness: float) -> skin.Metric:
    """Strain, whatever its direction, and compression: two loads, each with its own plays.

    A strain's size is √((xx² + yy²)/2 + xy²), the mean strain where both directions are strained
    alike. That of a depth is the compression of a layer of this ``thickness``, m.
    """
    return skin.Metric(((0.5, 0.5, 1.0), (thickness**-2,)))


@dataclass(frozen=True, eq=False)
class MaterialState:
    """What the sheet remembers.

    Attributes
    ----------
    memory
        Of strain xx, yy, xy and depth, by :func:`metric_of`.
    worn
        (n,) mean strain, summed over all loading.
    warmer
        K above the temperature of the unloaded sheet's conductivity.
    """

    memory: skin.MemoryState
    worn: FloatArray
    warmer: float = 0.0

    @classmethod
    def fresh(cls, settings: MaterialSettings, n: int) -> MaterialState:
        """A sheet of ``n`` cells that nothing has touched."""
        metric = metric_of(settings.thickness)
        return cls(memory=skin.MemoryState.fresh(settings.memory, n, metric), worn=np.zeros(n))


def stepped(
    state: MaterialState,
    settings: MaterialSettings,
    load: FloatArray,
    dt: float,
    chance: float,
    *,
    unloaded: FloatArray,
) -> tuple[MaterialState, FloatArray]:
    """What :func:`advance` gives, and the :func:`conductivity` then.

    Natively in one pass, and in the memory of ``state``, which is of no use afterwards.
    """
    if (core := choose_engine().core) is None:
        after = advance(state, settings, load, dt, chance)
        return after, conductivity(after, settings, unloaded)
    skin.check_step(dt)
    past, memory = state.memory, settings.memory
    worn = state.worn if settings.wear else state.worn[:0]
    warmer = _warmed(state.warmer, settings, dt, chance)
    play, creep, breakdown = _series(memory, dt)
    parts = past.lagging, past.late, past.broken
    rows = core.conducted(
        (load, past.load, unloaded),
        (*parts, worn),
        (play, creep, breakdown),
        (
            settings.thickness,
            settings.gauge,
            settings.gauge_across,
            settings.compression,
            settings.wear,
            1 + settings.temperature_coefficient * warmer,
            _MOST_COMPRESSION,
            _MOST_LOG,
        ),
    )
    sigma = rows[0] if settings.scalar else rows.reshape(2, 2, -1).transpose(2, 0, 1)
    return MaterialState(skin.MemoryState(load, *parts), state.worn, warmer), sigma


def advance(
    state: MaterialState,
    settings: MaterialSettings,
    load: FloatArray,
    dt: float,
    chance: float = 0.0,
) -> MaterialState:
    """The state after the load has stood for ``dt`` s; exact for any length of the step.

    The load is taken to jump at the start of the step. ``chance`` is a standard normal number
    for the temperature.

    Raises
    ------
    ModelError
        When dt is negative or not finite.
    """
    metric = metric_of(settings.thickness)
    return MaterialState(
        memory=skin.advanced(state.memory, settings.memory, load, dt, metric),
        worn=_worn(state, load, settings),
        warmer=_warmed(state.warmer, settings, dt, chance),
    )


def conductivity(
    state: MaterialState, settings: MaterialSettings, unloaded: FloatArray
) -> FloatArray:
    """(n_cells,) S, or (n_cells, 2, 2) where directions differ.

    σ = σ₀ · (1 + c·compression) · exp(−wear) / (1 + α ΔT) · exp(−g·mean strain) ·
    exp(−g_across · deviator), the last a matrix exponential: positive at any strain, and the
    gauge factors' straight line near none. Breakdown adds to the mean strain: it has no direction.

    Parameters
    ----------
    unloaded
        (n_cells,) S.
    """
    memory = settings.memory
    xx, yy, xy, depth = skin.followed(state.memory, memory)
    squeezed = np.clip(depth / settings.thickness, -_MOST_COMPRESSION, _MOST_COMPRESSION)
    rise = xx + yy
    if memory.breakdown:
        rise += 2 * skin.broken_down(state.memory, memory)[0]
    rise *= -settings.gauge / 2
    if settings.wear:
        rise -= settings.wear * state.worn
    np.clip(rise, -_MOST_LOG, _MOST_LOG, out=rise)
    level = unloaded * np.maximum(1 + settings.compression * squeezed, 1e-3)
    level /= max(1 + settings.temperature_coefficient * state.warmer, 1e-3)
    if settings.scalar:
        return np.asarray(level * np.exp(rise))
    half, cross = settings.gauge_across / 2 * (xx - yy), settings.gauge_across * xy
    return _directed(level, rise, half, cross)


def _series(memory: skin.MaterialMemory, dt: float) -> tuple[list[tuple[float, float]], ...]:
    """Parts of plays with their half widths; of creep and breakdown with what ``dt`` s leave."""
    return (
        list(zip(memory.play, memory.play_widths, strict=True)),
        [(p, math.exp(-dt / t)) for p, t in zip(memory.creep, memory.creep_times, strict=True)],
        [
            (p, math.exp(-dt / t))
            for p, t in zip(memory.breakdown, memory.breakdown_times, strict=True)
        ],
    )


def _worn(state: MaterialState, felt: FloatArray, settings: MaterialSettings) -> FloatArray:
    if settings.wear == 0:
        return state.worn
    before = state.memory.load
    rise = (felt[0] + felt[1] - before[0] - before[1]) / 2
    return np.asarray(state.worn + np.maximum(rise, 0.0))


def _warmed(warmer: float, settings: MaterialSettings, dt: float, chance: float) -> float:
    if settings.temperature_sd == 0:
        return warmer
    sd, time = settings.temperature_sd, settings.temperature_time
    return float(wandered(warmer, sd, time, dt, chance))


def _directed(
    level: FloatArray, rise: FloatArray, half: FloatArray, cross: FloatArray
) -> FloatArray:
    """(n, 2, 2) level · exp(rise − M) for M = [[half, cross], [cross, −half]].

    M² = d², so that exp(rise − M) = eʳ (cosh d − sinh(d)/d · M). The components lie in rows, as
    the forward model reads them.
    """
    size = np.maximum(np.hypot(half, cross), 1e-12)  # sinh(d)/d is 1 there
    bounded = np.minimum(size, _MOST_LOG)
    even, odd = np.cosh(bounded), np.sinh(bounded) / size
    parts = np.array([[even - odd * half, -odd * cross], [-odd * cross, even + odd * half]])
    return np.asarray((level * np.exp(rise) * parts).transpose(2, 0, 1))


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
