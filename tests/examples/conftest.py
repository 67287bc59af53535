"""The examples as a person runs them: each once on the twin, recorded, for every test."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest

from claims import ROOT, Claim, claims

FOLDER = ROOT / "examples"


@dataclass(frozen=True)
class Run:
    """An example's module, the numbers of its first run, where its figure and frames are."""

    module: ModuleType
    found: dict[str, float]
    figure: Path
    recording: Path


@pytest.fixture(scope="session")
def published() -> dict[str, Claim]:
    """What the gallery shows of each example, by its name."""
    return {claim.name: claim for claim in claims() if claim.part == "gallery"}


@pytest.fixture(scope="session")
def imported() -> Iterator[Callable[[str], ModuleType]]:
    """Import a module of the examples' folder."""
    sys.path.insert(0, str(FOLDER))
    yield importlib.import_module
    sys.path.remove(str(FOLDER))


@pytest.fixture(scope="session")
def ran(
    imported: Callable[[str], ModuleType], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Run]:
    """Run an example on the twin, the first time that it is asked for."""
    out = tmp_path_factory.mktemp("figures")

    @cache
    def run(name: str) -> Run:
        recording = out / f"{name}.mcap"
        module = imported(name)
        found = module.main(["--out", str(out), "--record", str(recording)])
        return Run(module, found, out / f"{name}.png", recording)

    return run
