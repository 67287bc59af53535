"""A command run in this process, as a person would meet it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tomoskin.cli import main

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def tomoskin(capfd: pytest.CaptureFixture[str]) -> Run:
    """Run a command: (exit code, stdout, stderr)."""

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as end:
            main([str(argument) for argument in arguments])
        return int(end.value.code or 0), *capfd.readouterr()

    return run
