"""Sections as records: what a declaration gives by itself."""

from __future__ import annotations

import dataclasses

import pytest

from tomoskin.core import SkinError
from tomoskin.model.section import Choice, Quantity, Row, Section, Table, Whole, key

_LENGTH = Quantity("length", "mm", 0, 100)
_TIME = Quantity("time", "s", 0, 10)


class Rod(Section, section="rod", many=True):
    """A rod. It has
    ends."""

    shape: str = key(Choice(("round", "flat")), "Which.", default="round")
    radius: float | None = key(_LENGTH, "Of a round one.", shape="round")
    length: float = key(_LENGTH, "From end to end.", default="20 mm", unless="ends")
    ends: tuple[float, float] | None = key(
        Row({"low": _LENGTH, "high": _LENGTH}), "Where it ends.", default=None, needs="count"
    )
    count: int | None = key(Whole(1, 5), "How many.", default=None)


def test_a_record_has_its_defaults_in_si_units() -> None:
    rod = Rod.read({"radius": "5 mm"}, "my.toml: [[rod]] 1")
    assert rod == Rod(radius=0.005)
    assert (rod.shape, rod.length, rod.ends) == ("round", 0.02, None)
    with pytest.raises(dataclasses.FrozenInstanceError):
        rod.length = 1.0  # type: ignore[misc]


def test_a_section_says_what_it_is() -> None:
    assert (Rod.section, Rod.heading, Rod.meaning) == ("rod", "[[rod]]", "A rod. It has ends.")
    assert [key.name for key in Rod.keys if key.required] == ["radius"]


def test_what_is_written_is_kept_beside_what_is_meant() -> None:
    written = Rod.complete({"shape": "flat", "length": "1 cm"}, "")
    assert written == {"shape": "flat", "length": "1 cm"}
    assert Rod.read(written, "").length == 0.01


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "rod radius: is missing; expected a length from 0 to 100 mm"),
        ({"shape": "flat", "radius": "5 mm"}, 'needs shape = "round", got shape = "flat"'),
        ({"shape": "flat", "length": "1 m"}, 'expected a length from 0 to 100 mm, got "1 m"'),
        ({"shape": "flat", "ends": ["0 mm", "1 mm"]}, "rod ends: needs the key count as well"),
        (
            {"shape": "flat", "ends": ["0 mm", "1 mm"], "count": 1, "length": "1 mm"},
            "rod length: cannot be combined with ends",
        ),
        (
            {"shape": "flat", "ends": ["0 mm"], "count": 1},
            "expected a pair [low, high], each a length from 0 to 100 mm",
        ),
        ({"sharp": True}, 'rod: unknown key "sharp" (did you mean "shape"?)'),
    ],
)
def test_an_error_says_where_what_was_expected_and_what_is_there(
    given: dict[str, object], message: str
) -> None:
    with pytest.raises(SkinError) as caught:
        Rod.read(given, "rod")
    assert message in str(caught.value)


def test_a_course_goes_on_in_time() -> None:
    course = Table(Row({"time": _TIME, "place": _LENGTH}), ascending=True)
    assert course.read([["1 s", "1 mm"], ["2 s", "0 mm"]]) == ((1.0, 0.001), (2.0, 0.0))
    with pytest.raises(ValueError, match="row 1: expected a time after 1 s, got 1 s"):
        course.read([["1 s", "1 mm"], ["1 s", "0 mm"]])
    with pytest.raises(ValueError, match="row 0, place: expected a length"):
        course.read([["1 s", 7]])


def test_a_default_that_cannot_be_read_is_named() -> None:
    with pytest.raises(ValueError, match=r'default of "How long\.": expected a length'):
        key(_LENGTH, "How long.", default=0.02)


@dataclasses.dataclass(frozen=True)
class _Bent:
    radius: float = key(_LENGTH, "Of the bend.", default="9 mm")


def test_a_word_may_not_bring_a_key_that_is_there() -> None:
    with pytest.raises(TypeError, match="bent: radius is a key of Pipe already"):

        class Pipe(Section, section="pipe"):
            radius: float = key(_LENGTH, "Of the pipe.", default="5 mm")
            form: str = key(Choice(("bent",)), "Which.", default="bent", options={"bent": _Bent()})
