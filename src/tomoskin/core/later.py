"""Packages whose names are loaded when they are first asked for."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any


def later(package: str, *modules: str) -> Callable[[str], Any]:
    """The ``__getattr__`` of a ``package`` that offers names of some of its ``modules``.

    What it offers stands behind ``if TYPE_CHECKING:``, so that nothing is loaded with the package.
    """

    def find(name: str) -> Any:
        for module in () if name.startswith("_") else modules:
            loaded = import_module(f"{package}.{module}")
            if hasattr(loaded, name):
                return getattr(loaded, name)
        raise AttributeError(f"module {package!r} has no attribute {name!r}")

    return find
