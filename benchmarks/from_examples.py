"""Modules of the examples' folder, for what they and a benchmark have in common."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

_FOLDER = Path(__file__).resolve().parents[1] / "examples"


def load_example(name: str) -> ModuleType:
    """The example of that name; it may import its neighbours."""
    sys.path.insert(0, str(_FOLDER))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(_FOLDER))
