"""What all tests of the room rest on."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import pytest

from cli.conftest import tomoskin
from tomoskin.board.source import Timing

__all__ = ["tomoskin"]


@pytest.fixture(scope="module", autouse=True)
def patient_links() -> Iterator[None]:
    """A busy machine may hold up the test's own board: that is no silence of a board."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tomoskin.board.source.link.Timing", partial(Timing, silence=300.0))
        yield
