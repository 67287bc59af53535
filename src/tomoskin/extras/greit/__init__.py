"""GREIT, a trained operator, and figures of merit of operators and images."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tomoskin.core import later

if TYPE_CHECKING:
    from tomoskin.extras.greit.merit import (
        Merit as Merit,
        Targets as Targets,
        ThesisMetrics as ThesisMetrics,
        along as along,
        figures as figures,
    )
    from tomoskin.extras.greit.trainer import Greit as Greit

__getattr__ = later(__name__, "merit", "trainer")
