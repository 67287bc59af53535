"""Which engine runs: tomoskin_core where it works, here by a trial of it, else scipy and numpy."""

from __future__ import annotations

import importlib
import os
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from tomoskin.core import FloatArray, ModelError
from tomoskin.model.forward.engine import (
    BaseState,
    Engine,
    Factor,
    Factorise,
    Patches,
    singular,
)
from tomoskin.model.pattern import Pattern

VARIABLE = "TOMOSKIN_ENGINE"
"""Environment variable that asks for one engine: scipy or native."""

INTERFACE = 8
"""The interface of tomoskin_core that is called here and in ``touch``; raised with its own."""


@dataclass(frozen=True)
class Native(Engine):
    """Cholesky, products and rows of ``core``, the module tomoskin_core."""

    name: str = "native"

    def analyse(self, indptr: NDArray[np.int32], indices: NDArray[np.int32]) -> Factorise:
        """Order the unknowns and lay out the factor, once for all matrices of this structure."""
        symbolic = self.core.Symbolic(len(indptr) - 1, indptr, indices)

        def factorise_natively(values: NDArray[Any]) -> Factor:
            try:
                factor: Factor = symbolic.factor(values)
            except ValueError as error:
                raise singular() from error
            return factor

        return factorise_natively

    def fields(self, operator: csr_array, vectors: NDArray[Any], out: NDArray[Any]) -> None:
        """Write the product of operator and vectors, transposed, into ``out``."""
        indptr, indices = (
            part.astype(np.int32, copy=False) for part in (operator.indptr, operator.indices)
        )
        self.core.transposed_product(indptr, indices, operator.data, vectors, out)

    def jacobian(
        self, gradient: NDArray[Any], pattern: Pattern, current: FloatArray
    ) -> NDArray[Any]:
        """The Jacobian of the pattern, computed by the native engine."""
        rows: NDArray[Any] = self.core.jacobian(
            gradient, pattern.drives, current, pattern.drive_index, pattern.measure
        )
        return rows

    def patches(self, base: BaseState) -> Patches:
        """The native engine's changes about one state of the sheet."""
        made: Patches = self.core.Patches(
            base.cells, base.local, base.held, base.conductivity, base.fields, base.grounded
        )
        return made


def choose_engine() -> Engine:
    """Return the engine that TOMOSKIN_ENGINE asks for; without it the native one if it works.

    Raises
    ------
    ModelError
        When the variable names no engine, or the native one, and that does not work.
    """
    choice = ""
    if VARIABLE in os.environ:  # get takes three times as long where it is not there
        choice = os.environ[VARIABLE]
    if choice not in ("", "scipy", "native"):
        raise ModelError(f"expected {VARIABLE} to be scipy or native, got {choice!r}")
    if choice == "scipy":
        return Engine(f"{VARIABLE} asks for it")
    engine = _native()
    if choice == "native" and not isinstance(engine, Native):
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
        if (built_for := getattr(core, "interface", 1)) != INTERFACE:
            raise ModelError(
                f"it was built for another tomoskin (interface {built_for}, expected {INTERFACE}); "
                "build it again: make native"
            )
        return Native(f"tomoskin_core {core.__version__} is installed", core=core)
    except ModuleNotFoundError:
        return Engine("tomoskin_core is not installed")
    except Exception as error:
        return Engine(f"tomoskin_core does not work here: {error}")
