"""Packages of ROS in the folders above a file, found without ROS; xacros that name them."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from tomoskin.core import SkinError, needed

_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")
_MANIFEST = "package.xml"

_patched = threading.Lock()
"""Xacro has one way to find packages for all who use it."""


def package_folder(name: str, file: Path) -> Path | None:
    """The package of that name that ``file`` lies in, or that lies beside a folder above it.

    The name is that of a folder, or stands in its package.xml. None: there is none.
    """
    for folder in file.absolute().parents:
        if _is_package(folder, name):
            return folder
        if (folder / name).is_dir():
            return folder / name
    return None


def _is_package(folder: Path, name: str) -> bool:
    manifest = folder / _MANIFEST
    if not manifest.is_file():
        return folder.name == name
    named = _NAME.search(manifest.read_text(encoding="utf-8", errors="replace"))
    return named is not None and named[1] == name


def expanded(path: Path) -> str:
    """The URDF that a xacro makes, with its arguments' own defaults.

    ``$(find NAME)`` is a package in the folders above, else what ROS says where it is there.
    Raises SkinError.
    """
    xacro = needed("xacro", "xacro", path, SkinError)
    substitution = needed("xacro.substitution_args", "xacro", path, SkinError)
    try:
        with _finding(substitution, path):
            return str(xacro.process_file(str(path)).toxml())
    except Exception as error:  # of any kind, since the file's expressions are Python's
        raise SkinError(f"cannot be expanded by xacro: {error}", where=str(path)) from error


@contextmanager
def _finding(substitution: object, path: Path) -> Iterator[None]:
    """Let xacro look for packages above ``path`` first."""
    with _patched:
        of_ros: Callable[[str], str] = vars(substitution)["_eval_find"]

        def find(name: str) -> str:
            folder = package_folder(name, path)
            if folder is not None:
                return str(folder)
            try:
                return of_ros(name)
            except Exception as error:  # without ROS its index is no module
                raise SkinError(
                    f'expected the package "{name}" in a folder above, or ROS, got neither'
                ) from error

        known = vars(substitution)["_eval_dict"]
        vars(substitution)["_eval_find"] = known["find"] = find
        try:
            yield
        finally:
            vars(substitution)["_eval_find"] = known["find"] = of_ros
