"""Meshes on disk: each command of a skin needs the same ones, and one takes half a second."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import scipy

from tomoskin.core import Arrays, kept
from tomoskin.model import mesh as generator
from tomoskin.model.mesh import Mesh


def kept_mesh(wanted: str, make: Callable[[], Mesh]) -> Mesh:
    """The flat mesh that ``make`` returns, kept on disk; ``wanted`` says all that it depends on."""
    key = hashlib.sha256(_versions() + wanted.encode()).hexdigest()[:32]
    arrays = kept(f"mesh-{key}", lambda: _packed(make()))
    ends = np.cumsum(arrays["facets"])[:-1]
    return Mesh(arrays["points"], arrays["cells"], tuple(np.split(arrays["electrodes"], ends)))


def _packed(mesh: Mesh) -> Arrays:
    return {
        "points": mesh.points,
        "cells": mesh.cells,
        "electrodes": np.concatenate(mesh.electrodes),
        "facets": np.array([len(facets) for facets in mesh.electrodes]),
    }


@cache
def _versions() -> bytes:
    """What makes meshes: other code may make other ones."""
    digest = hashlib.sha256(f"{np.__version__} {scipy.__version__}".encode())
    for path in sorted(Path(generator.__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.digest()
