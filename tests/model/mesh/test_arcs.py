"""Electrodes on an outline: what fits and what does not."""

from __future__ import annotations

import math

import pytest

from tomoskin.core import GeometryError
from tomoskin.model.mesh import Disc, ElectrodeArc, check_arcs

DISC = Disc(0.1)
LENGTH = DISC.length


def test_width_of_plain_and_wrapping_arcs() -> None:
    assert ElectrodeArc(0.1, 0.15).width(DISC) == pytest.approx(0.05)
    assert ElectrodeArc(LENGTH - 0.01, 0.02).width(DISC) == pytest.approx(0.03)
    assert ElectrodeArc.around(0.0, 0.01) == ElectrodeArc(-0.005, 0.005)


def test_neighbours_with_room_between_them_are_accepted() -> None:
    check_arcs(DISC, [ElectrodeArc(0.0, 0.01), ElectrodeArc(0.0101, 0.02)])
    check_arcs(DISC, [ElectrodeArc(0.3, 0.31), ElectrodeArc.around(0.0, 0.01)])
    check_arcs(DISC, [ElectrodeArc(0.0, LENGTH * 0.99)])


@pytest.mark.parametrize(
    ("arcs", "where", "message"),
    [
        ([], "", "at least one electrode"),
        ([(0.0, 0.01), (0.1, 0.1)], "E2", "width above 0 mm"),
        ([(0.0, math.nan)], "E1", "finite"),
        ([(0.1, 0.1 + LENGTH)], "E1", "longer than the outline"),
        ([(0.0, 3 * LENGTH)], "E1", "longer than the outline"),
        ([(0.0, 0.02), (0.1, 0.12), (0.01, 0.03)], "E3", "overlaps E1 by 10 mm"),
        ([(0.1, 0.3), (0.15, 0.16)], "E2", "overlaps E1"),
        ([(0.01, 0.02), (-0.03, 0.015)], "E2", "overlaps E1 by 5 mm"),
        ([(0.0, 0.02), (0.02, 0.03)], "E2", "is 0 mm from E1"),
        ([(0.0, 0.02), (0.02005, 0.03)], "E2", "expected at least 1%"),
        ([(0.1, 0.2), (0.1, 0.2)], "E2", "overlaps E1"),
    ],
)
def test_electrodes_without_room(arcs: list[tuple[float, float]], where: str, message: str) -> None:
    with pytest.raises(GeometryError, match=message) as caught:
        check_arcs(DISC, [ElectrodeArc(*arc) for arc in arcs])
    assert caught.value.where == where
