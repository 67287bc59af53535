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


QUICK = ("session", "doctor", "firmware", "skin check")
"""Commands of less than a second of processor time."""


def test_every_snippet_and_quick_command_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    assert run(blocks, QUICK) > 3
    assert (tmp_path / "from-table.npz").exists()


@pytest.mark.slow
def test_every_answer_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    assert run(blocks, ("",)) > 10
    assert (tmp_path / "mine.png").read_bytes().startswith(b"\x89PNG")


def run(blocks: list[tuple[str, str]], commands: tuple[str, ...]) -> int:
    """Run all Python, and the commands that begin so where their input is there; their number."""
    names: dict[str, Any] = {}
    count = 0
    for language, block in blocks:
        if language == "python":
            exec(compile(block, PAGE.name, "exec"), names)
            continue
        for line in block.splitlines():
            program, *arguments = shlex.split(line)
            assert program == "tomoskin"
            if " ".join(arguments).startswith(commands) and inputs_exist(arguments):
                with pytest.raises(SystemExit) as end:
                    main(arguments)
                assert not end.value.code, line
                count += 1
    return count


def inputs_exist(arguments: list[str]) -> bool:
    """Whether a recording that the command reads was made before."""
    return all(
        Path(a).exists() for a in arguments if a.endswith(".mcap") and "--out" not in arguments
    )
