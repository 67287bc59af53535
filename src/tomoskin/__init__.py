"""tomoskin: touch for soft robots by electrical impedance tomography."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tomoskin.calibration import Locator
    from tomoskin.formats import plot
    from tomoskin.forward import ForwardModel
    from tomoskin.inverse import OneStep
    from tomoskin.mesh import Mesh
    from tomoskin.pattern import Pattern
    from tomoskin.recording import Session
    from tomoskin.skin import Skin

__version__ = "0.1.0"

_HOME = {
    "ForwardModel": "forward",
    "Locator": "calibration",
    "Mesh": "mesh",
    "OneStep": "inverse",
    "Pattern": "pattern",
    "Session": "recording",
    "Skin": "skin",
    "plot": "formats",
}
"""Where each public name lives; it is imported when it is first asked for."""

__all__ = [
    "ForwardModel",
    "Locator",
    "Mesh",
    "OneStep",
    "Pattern",
    "Session",
    "Skin",
    "__version__",
    "plot",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'tomoskin' has no attribute {name!r}")
    return getattr(import_module(f"tomoskin.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
