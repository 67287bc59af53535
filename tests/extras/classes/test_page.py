"""What the page shows runs, on what it takes as given."""

from __future__ import annotations

from typing import Any

import pytest

from test_docs_fragments import given, run_blocks

__all__ = ["given"]


def test_what_the_page_takes_as_given_is_all_it_needs(
    given: dict[str, Any], tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run_blocks("extras/classes", given)
