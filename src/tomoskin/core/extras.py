"""Packages that only some work needs: how a person installs those of an extra."""

from __future__ import annotations

import importlib
import sys
from importlib.metadata import PackageNotFoundError, requires
from typing import Any

from tomoskin.core.errors import DataError, TomoskinError


def install_hint(extra: str) -> str:
    """The command that installs what ``extra`` stands for, into the Python that runs.

    It names the packages, not the extra: that works in a checkout too, whose version no index has.
    """
    names = " ".join(f'"{name}"' for name in _requirements(extra)) or f'"tomoskin[{extra}]"'
    python = f'"{sys.executable}"' if " " in sys.executable else sys.executable
    return f"{python} -m pip install {names}"


def needed(module: str, extra: str, where: object, error: type[TomoskinError] = DataError) -> Any:
    """A module that some work cannot do without.

    Raises
    ------
    TomoskinError
        Of the kind ``error``, when it is not installed or cannot be loaded; names the extra that
        brings it.
    """
    try:
        return importlib.import_module(module)
    except (ImportError, OSError, RuntimeError) as reason:
        raise error(
            f"needs the package {module.partition('.')[0]}: {reason}",
            where=str(where),
            hint=install_hint(extra),
        ) from reason


def _requirements(extra: str) -> list[str]:
    try:
        listed = requires("tomoskin") or []
    except PackageNotFoundError:
        return []
    parted = [line.replace("'", '"').partition(";") for line in listed]
    marked = ["extra", "==", f'"{extra}"']
    return [name.strip() for name, _, marker in parted if marker.split() == marked]
