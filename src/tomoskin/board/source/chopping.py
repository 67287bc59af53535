"""The alternating drive on a board: the periods of a drive, and which frequency is too high.

Each direction of a drive reads every channel. Fewer periods make a faster scan, and more
conversions in each direction, which must fit into half a period.
"""

from __future__ import annotations

from tomoskin.board.source.settings import ScanSettings
from tomoskin.board.wire import BoardLimits
from tomoskin.core import SourceError

_US = 1000
"""ns."""


def half_time(
    board: BoardLimits, settings: ScanSettings, periods: int, channels: int, tick_rate: float
) -> int:
    """ns that half a period takes at least; the firmware works it out in the same way.

    ``channels`` that are read in each half; ``tick_rate`` of the board, Hz.
    """
    us_per_tick = round(1e6 / tick_rate)
    ticks = -(-round(settings.settling * 1e6) // us_per_tick) + 1
    conversion = board.conversion + board.clock * settings.prescaler
    sample = board.sample + settings.oversampling // (2 * periods) * conversion
    fixed = board.half + _US * round(settings.dead_time * 1e6) + _US * us_per_tick * ticks
    return fixed + channels * sample


def chop_limit(
    board: BoardLimits, settings: ScanSettings, periods: int, channels: int, tick_rate: float
) -> int:
    """Hz: the highest frequency that the board can do with so many periods a drive."""
    half = half_time(board, settings, periods, channels, tick_rate)
    return min(500_000_000 // max(half, 1), board.max_chop)


def choose_periods(
    board: BoardLimits, settings: ScanSettings, channels: int, tick_rate: float, where: str
) -> int:
    """The fewest periods a drive with which the board can do ``settings``; 0 for a direct drive.

    Raises
    ------
    SourceError
        When the frequency is beyond the board's bounds, with the limit, or the conversions cannot
        be shared between the two directions.
    """
    wanted, each = settings.chop_frequency, settings.oversampling // 2
    if not wanted:
        return 0
    if settings.oversampling % 2:
        raise SourceError(
            f"an alternating drive reads as often in either direction: {settings.oversampling} "
            "conversions a sample cannot be halved",
            where=where,
            hint="set [readout] oversampling to an even number, for a converter of 12 bits one "
            "that 8 divides",
        )
    if wanted < board.min_chop:
        raise SourceError(
            f"the skin is driven alternately at {wanted} Hz, the {board.text} does at least "
            f"{board.min_chop} Hz",
            where=where,
            hint="raise [drive] chop_frequency",
        )
    possible = [periods for periods in range(1, each + 1) if each % periods == 0]
    limits = {p: chop_limit(board, settings, p, channels, tick_rate) for p in possible}
    if wanted > max(limits.values()):
        raise SourceError(
            f"the skin is driven alternately at {wanted} Hz; with {channels} electrodes to read "
            f"and {settings.settling * 1e6:.0f} µs to settle in each half period the {board.text} "
            f"does at most {max(limits.values())} Hz",
            where=where,
            hint="lower [drive] chop_frequency, or [readout] settling if the skin settles faster",
        )
    return next(periods for periods in possible if wanted <= limits[periods])
