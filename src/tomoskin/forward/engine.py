"""Who does the heavy arithmetic: tomoskin_core where it works, else scipy and numpy."""

from __future__ import annotations

import importlib
import os
from functools import cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, ModelError
from tomoskin.forward.factor import Compressed, Factorise
from tomoskin.forward.native import Native
from tomoskin.forward.patches import BaseState, Patches
from tomoskin.forward.plain import Scipy
from tomoskin.pattern import Pattern

VARIABLE = "TOMOSKIN_ENGINE"
"""Environment variable that asks for one engine: scipy or native."""


class Engine(Protocol):
    """The arithmetic that both ways do alike.

    Attributes
    ----------
    name
        ``native`` or ``scipy``.
    reason
        Why this one runs, in words.
    """

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def reason(self) -> str: ...  # noqa: D102

    def analyse(self, indptr: NDArray[np.int32], indices: NDArray[np.int32]) -> Factorise:
        """Return what factorises symmetric matrices of this structure, given their values."""
        ...

    def residual(
        self, matrix: Compressed, rhs: NDArray[Any], solution: NDArray[Any]
    ) -> tuple[NDArray[Any], float]:
        """Xᵀ (B − A X), and the largest entry of B − A X; NaN where X is no number."""
        ...

    def fields(self, operator: csr_array, vectors: NDArray[Any], out: NDArray[Any]) -> None:
        """Write ``operator`` times ``vectors`` (n, k) to ``out`` (k, n_rows)."""
        ...

    def jacobian(
        self, gradient: NDArray[Any], pattern: Pattern, current: FloatArray
    ) -> NDArray[Any]:
        """(n_meas, n_cells) from scaled gradients (n_electrodes, components, n_cells)."""
        ...

    def patches(self, base: BaseState) -> Patches:
        """What computes the changes of a state by a touch."""
        ...


def choose_engine() -> Engine:
    """Return the engine that TOMOSKIN_ENGINE asks for; without it the native one if it works.

    Raises
    ------
    ModelError
        When the variable names no engine, or the native one, and that does not work.
    """
    wanted = os.environ.get(VARIABLE, "")
    if wanted not in ("", "scipy", "native"):
        raise ModelError(f"expected {VARIABLE} to be scipy or native, got {wanted!r}")
    if wanted == "scipy":
        return Scipy(f"{VARIABLE} asks for it")
    engine = _native()
    if wanted == "native" and not isinstance(engine, Native):
        raise ModelError(
            f"{VARIABLE} asks for the native engine, but {engine.reason}",
            hint="install tomoskin-core (pip install ./core-native), or unset the variable",
        )
    return engine


@cache
def _native() -> Engine:
    """Return the native engine after a trial, else scipy's with what went wrong as its reason."""
    try:
        core = importlib.import_module("tomoskin_core")
        engine = Native(core, f"tomoskin_core {core.__version__} is installed")
        engine.check()
    except ModuleNotFoundError:
        return Scipy("tomoskin_core is not installed")
    except Exception as error:
        return Scipy(f"tomoskin_core does not work here: {error}")
    return engine
