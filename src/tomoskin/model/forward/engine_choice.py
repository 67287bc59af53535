"""Which engine runs: tomoskin_core where it works, else scipy and numpy."""

from __future__ import annotations

import importlib
import os
from functools import cache

from tomoskin.core import ModelError
from tomoskin.model.forward.engine import Engine
from tomoskin.model.forward.native import Native
from tomoskin.model.forward.plain import Scipy

VARIABLE = "TOMOSKIN_ENGINE"
"""Environment variable that asks for one engine: scipy or native."""


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
        return Scipy(f"{VARIABLE} asks for it")
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
        engine = Native(core, f"tomoskin_core {core.__version__} is installed")
        engine.check()
    except ModuleNotFoundError:
        return Scipy("tomoskin_core is not installed")
    except Exception as error:
        return Scipy(f"tomoskin_core does not work here: {error}")
    return engine
