"""JSON of names that are no text."""

from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
import pytest

from tomoskin.core import encode_json


@dataclass
class _File:
    name: str
    size: int


def test_what_is_no_utf8_is_a_question_mark_and_the_rest_as_it_is():
    content = {"files": (_File("a\udcffb", 1), _File("é", 2)), "\ud800": [1.5, float("nan"), None]}
    assert msgspec.json.decode(encode_json(content)) == {
        "files": [{"name": "a?b", "size": 1}, {"name": "é", "size": 2}],
        "?": [1.5, None, None],
    }


def test_numbers_of_numpy_are_plain_either_way():
    for name in ("a", "\udcff"):
        content = [np.float32(1.5), np.arange(2), name]
        assert msgspec.json.decode(encode_json(content))[:2] == [1.5, [0, 1]]


def test_what_has_no_json_is_refused_either_way():
    for name in ("a", "\udcff"):
        with pytest.raises(NotImplementedError, match="expected plain values"):
            encode_json([Path("x"), name])
