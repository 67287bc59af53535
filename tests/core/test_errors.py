"""Errors are one line that says where, what and what to do."""

from __future__ import annotations

import pytest

from tomoskin import core
from tomoskin.core import TomoskinError, no_such


@pytest.mark.parametrize(
    ("where", "hint", "line"),
    [
        ("", "", "expected 3, got 4"),
        ("row 7", "", "row 7: expected 3, got 4"),
        ("", "count again", "expected 3, got 4 (count again)"),
        ("row 7", "count again", "row 7: expected 3, got 4 (count again)"),
    ],
)
def test_line(where: str, hint: str, line: str) -> None:
    error = TomoskinError("expected 3, got 4", where=where, hint=hint)
    assert str(error) == line
    assert (error.message, error.where, error.hint) == ("expected 3, got 4", where, hint)


def test_every_error_of_the_library_is_caught_as_one() -> None:
    errors = [getattr(core, name) for name in dir(core) if name.endswith("Error")]
    assert len(errors) >= 8
    assert all(issubclass(error, TomoskinError) for error in errors)


def test_a_word_that_is_none_of_the_known_is_compared_with_them() -> None:
    assert no_such("mgea", ["mega", "pico"]) == (
        'expected mega or pico, got "mgea"; did you mean "mega"?'
    )
    assert no_such("x", ["a", "b"], "a kind") == 'expected a kind among a, b, got "x"'
