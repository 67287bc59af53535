"""Which tomoskin a worker has: its versions, and a hash of the code that makes labelled frames.

Workers get this module by its text, since theirs may be another, or none. So it needs the standard
library alone.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import importlib.metadata
import sys
from pathlib import Path

ROOMS = (
    "core", "model", "imaging", "board", "sensing", "learning", "pipeline", "twin",
    "extras/labelled",
)  # fmt: skip
"""What a shard is made by."""

PACKAGES = ("tomoskin", "tomoskin-core", "numpy", "scipy")
"""Their versions are compared: with others a set is not the same to the bit."""

_KINDS = (".py", ".toml", ".json")


def fingerprint() -> dict[str, str]:
    """The versions of :data:`PACKAGES`, "none" where one is missing, and ``code``, a hash."""
    versions = {name: _version(name) for name in PACKAGES}
    with contextlib.suppress(ImportError):
        importlib.import_module("tomoskin.core")
    package = sys.modules.get("tomoskin")
    if package is None:
        return versions | {"tomoskin": "none", "code": "none"}
    versions["tomoskin"] = str(getattr(package, "__version__", versions["tomoskin"]))
    root = Path(str(package.__file__)).parent
    digest = hashlib.sha256()
    for file in sorted(file for room in ROOMS for file in (root / room).rglob("*")):
        if file.suffix in _KINDS:
            digest.update(file.relative_to(root).as_posix().encode())
            digest.update(file.read_bytes())
    return versions | {"code": digest.hexdigest()[:12]}


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "none"


def differences(expected: dict[str, str], theirs: dict[str, str]) -> str:
    """What of them is not the same, in words; "" where all is."""
    return ", ".join(
        f"{name} {theirs.get(name, 'none')} instead of {value}"
        for name, value in expected.items()
        if theirs.get(name, "none") != value
    )


def made_alike(expected: dict[str, str], plan: object, shard: int) -> object:
    """The shard, made by a worker whose fingerprint is the ``expected`` one.

    A worker may have come since all were asked. Raises RuntimeError where it is another.
    """
    if said := differences(expected, fingerprint()):
        raise RuntimeError(said)
    return importlib.import_module("tomoskin.extras.labelled.population").make_shard(plan, shard)
