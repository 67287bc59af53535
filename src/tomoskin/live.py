"""Deprecated: this room is now pipeline, run and server.

Its names work until 0.4, with a warning.
"""

from __future__ import annotations

from typing import Any

from tomoskin._moved import moved


def __getattr__(name: str) -> Any:
    return moved("live", name)
