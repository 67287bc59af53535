"""Every answer of the questions' page is run: snippets and commands, in their order."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest

from tomoskin.cli import main

PAGE = Path(__file__).resolve().parents[1] / "docs" / "faq.md"
BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def answers() -> list[str]:
    return re.split(r"^### ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]


def test_each_question_names_a_thread_and_is_answered_by_something_that_runs() -> None:
    assert len(answers()) >= 20
    for answer in answers():
        assert BLOCK.search(answer), answer[:60]
        assert re.match(r".*\?\n\n\(\[", answer), answer[:60]


def test_every_answer_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for language, block in BLOCK.findall(PAGE.read_text(encoding="utf-8")):
        if language == "python":
            exec(compile(block, PAGE.name, "exec"), names)
            continue
        for line in block.splitlines():
            program, *arguments = shlex.split(line)
            assert program == "tomoskin"
            with pytest.raises(SystemExit) as end:
                main(arguments)
            assert not end.value.code, line
    assert (tmp_path / "mine.csv").exists()
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")
