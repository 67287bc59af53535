"""``tomoskin explain``."""

from __future__ import annotations

import json

import pytest

from files.session.test_explanation import recorded  # noqa: F401 - a fixture
from tomoskin.cli import main


def run(capsys, *words: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as end:
        main(["explain", *words])
    out = capsys.readouterr()
    return int(end.value.code or 0), out.out, out.err


def test_a_frame_is_told_in_words_and_as_json(recorded, capsys):  # noqa: F811
    code, words, _ = run(capsys, str(recorded), "--frame", "50")
    assert (code, words.splitlines()[0][:9]) == (0, "frame 50,")
    _, document, _ = run(capsys, str(recorded), "--frame", "50", "--json")
    told = json.loads(document)
    assert told["frame"] == 50
    assert told["steps"][0]["step"] == "frame"


def test_a_touch_that_is_not_there_is_refused(recorded, capsys):  # noqa: F811
    code, _, error = run(capsys, str(recorded), "--frame", "50", "--touch", "9")
    assert code == 1
    assert "expected a touch of frame 50, got 9" in error
