"""Which patterns a board can read that reads against the electrode before the sink."""

from __future__ import annotations

import numpy as np
import pytest

import front_end
from tomoskin.board.source.agreement import unreadable_drives
from tomoskin.model.pattern import Pattern, Scan
from tomoskin.model.skin import Skin
from tomoskin.twin import TwinSettings, TwinSkin

GAIN = 1 + 49.4e3 / 1270
MIDDLE = 1.65


def clipped(name: str, skip: int, *, reversed_half: bool) -> tuple[int, int]:
    """How many samples of a half the converter cannot read, and of how many: without contacts."""
    r = TwinSkin.of(Skin.load(name), TwinSettings.preset("ideal")).resistance()
    scan = Scan.of(Pattern.skip(len(r), skip))
    source, sink = scan.drives[scan.sample_drive].T
    if reversed_half:
        source, sink = sink, source
    read, against = scan.sample_electrode, (sink - 1) % len(r)
    volts = r[source, read] - r[sink, read] - r[source, against] + r[sink, against]
    at_converter = MIDDLE + GAIN * front_end.AMPERES * volts
    outside = (at_converter < 0) | (at_converter > front_end.REFERENCE)
    return int(outside.sum()), len(outside)


@pytest.mark.parametrize(
    ("name", "found"), [("textile-disc-8", (24, 48)), ("textile-disc-16", (32, 224))]
)
def test_the_adjacent_pattern_clips_when_it_is_turned(name: str, found: tuple[int, int]) -> None:
    assert clipped(name, 0, reversed_half=True) == found
    assert clipped(name, 0, reversed_half=False)[0] == 0


@pytest.mark.parametrize("name", ["textile-disc-8", "textile-disc-16"])
@pytest.mark.parametrize("skip", [1, 2])
def test_patterns_that_skip_are_read_in_both_directions(name: str, skip: int) -> None:
    for reversed_half in (False, True):
        assert clipped(name, skip, reversed_half=reversed_half)[0] == 0


@pytest.mark.parametrize("n", [8, 16, 32])
def test_what_is_refused_is_what_drives_its_reference(n: int) -> None:
    adjacent = Scan.of(Pattern.adjacent(n))
    assert unreadable_drives(adjacent, alternating=False) == []
    assert unreadable_drives(adjacent, alternating=True) == list(range(n))
    for skip in (1, 2):
        assert unreadable_drives(Scan.of(Pattern.skip(n, skip)), alternating=True) == []
    assert unreadable_drives(Scan.of(Pattern.opposite(n)), alternating=True) == []
    turned = Pattern.from_tables([[0, 1]], [[2, 3]], n)
    assert np.array_equal(unreadable_drives(Scan.of(turned), alternating=False), [0])
