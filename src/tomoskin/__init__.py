"""tomoskin: touch for soft robots by electrical impedance tomography."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tomoskin.files.exports import plot as plot
    from tomoskin.files.session import Session as Session
    from tomoskin.imaging import OneStep as OneStep
    from tomoskin.learning import Locator as Locator
    from tomoskin.model.forward import ForwardModel as ForwardModel
    from tomoskin.model.mesh import Mesh as Mesh
    from tomoskin.model.pattern import Pattern as Pattern
    from tomoskin.model.skin import Skin as Skin
    from tomoskin.run import open_skin as open_skin

__version__ = "0.1.0"

_HOME = {
    "ForwardModel": "model.forward",
    "Locator": "learning",
    "Mesh": "model.mesh",
    "OneStep": "imaging",
    "Pattern": "model.pattern",
    "Session": "files.session",
    "Skin": "model.skin",
    "open_skin": "run",
    "plot": "files.exports",
}
"""Where each public name lives; it is imported when it is first asked for."""

__all__ = ["__version__", *_HOME]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'tomoskin' has no attribute {name!r}")
    return getattr(import_module(f"tomoskin.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
