"""Recordings of other instruments and programs, and a skin file guessed from one."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tomoskin.core import later

if TYPE_CHECKING:
    from tomoskin.extras.instruments.guess import (
        guess_skin as guess_skin,
        order_fault as order_fault,
    )

__getattr__ = later(__name__, "guess")
