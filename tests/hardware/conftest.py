from __future__ import annotations

import shutil

import pytest

from conftest import missing


@pytest.fixture(scope="session")
def decks():
    """Skip what runs decks where there is no ngspice (under CI=true: fail)."""
    if shutil.which("ngspice") is None:
        missing("the board's circuit: no ngspice (Debian: apt-get install ngspice)")
