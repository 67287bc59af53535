"""Quantities as people write them."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from tomoskin.core import DIMENSIONS, parse_quantity

UNITS = [(dimension, unit) for dimension, units in DIMENSIONS.items() for unit in units]


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("200 mm", "length", 0.2),
        ("200mm", "length", 0.2),
        ("  20 cm ", "length", 0.2),
        ("-.5 m", "length", -0.5),
        ("+1.e-1 m", "length", 0.1),
        ("5 µs", "time", 5e-6),
        ("5 \N{GREEK SMALL LETTER MU}s", "time", 5e-6),
        ("5 us", "time", 5e-6),
        ("100 mA", "current", 0.1),
        ("0.8 ohm/sq", "sheet resistance", 0.8),
        ("0.8 Ω/sq", "sheet resistance", 0.8),
        ("300 Ω·cm", "resistivity", 3.0),
        ("90 deg", "angle", math.pi / 2),
        ("65 %", "ratio", 0.65),
        ("0.65", "ratio", 0.65),
        ("16 MHz", "frequency", 16e6),
        ("3 N", "force", 3.0),
        ("2 Mohm", "resistance", 2e6),
    ],
)
def test_quantity(text: str, dimension: str, value: float) -> None:
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("text", ["", "mm", "ten mm", "1,5 mm", "1 2 mm", "0x1 m", "nan m", "m 1"])
def test_no_number(text: str) -> None:
    with pytest.raises(ValueError, match=r"expected a number with a unit of length \(mm, .*, got"):
        parse_quantity(text, "length")


@pytest.mark.parametrize(
    ("text", "dimension", "got"),
    [
        ("200", "length", "got no unit"),
        ("200 inch", "length", 'got unit "inch"'),
        ("200 MM", "length", 'got unit "MM"'),
        ("1 mS", "time", 'got unit "mS"'),
        ("65 mm", "ratio", 'got unit "mm"'),
    ],
)
def test_wrong_unit_is_named_with_those_that_would_do(text: str, dimension: str, got: str) -> None:
    with pytest.raises(ValueError, match=f"expected a unit of {dimension} .*{got}"):
        parse_quantity(text, dimension)


def test_a_decimal_comma_gets_a_hint() -> None:
    with pytest.raises(ValueError, match=r'got "200,5 mm"; with a decimal point: "200.5 mm"'):
        parse_quantity("200,5 mm", "length")
    with pytest.raises(ValueError, match=r'got "1,200,5 mm"$'):
        parse_quantity("1,200,5 mm", "length")


@pytest.mark.parametrize("text", ["1e999 m", "-1e400 mm"])
def test_too_large_to_be_meant(text: str) -> None:
    with pytest.raises(ValueError, match="expected a finite number"):
        parse_quantity(text, "length")


@given(number=st.floats(-1e12, 1e12), place=st.sampled_from(UNITS))
def test_every_number_in_every_unit(number: float, place: tuple[str, str]) -> None:
    dimension, unit = place
    expected = number * DIMENSIONS[dimension][unit]
    assert parse_quantity(f"{number!r} {unit}", dimension) == expected


@given(st.text())
def test_any_other_text_is_a_value_error(text: str) -> None:
    try:
        value = parse_quantity(text, "ratio")
    except ValueError:
        return
    assert math.isfinite(value)
