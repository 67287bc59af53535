"""The dent of touches, computed while a page shows it, as often as pages are sent frames."""

from __future__ import annotations

from tomoskin.learning import DEPTH, DentMap, dent_map
from tomoskin.pipeline import FrameResult
from tomoskin.run import Runner
from tomoskin.server.page_connection import Handlers, Page
from tomoskin.server.page_messages import DentNow
from tomoskin.server.requests import ShowDent


class Dents:
    """The ``pages`` that show the dent of touches, and what they are sent."""

    def __init__(self, runner: Runner) -> None:
        self._runner = runner
        self.pages: set[Page] = set()
        self.handlers: Handlers = {ShowDent: self._show}

    def _show(self, page: Page, request: ShowDent) -> None:
        """Send dents from now on, or no more; answer why there are none."""
        prepared, problem = self._runner.prepared, ""
        if DEPTH.name not in prepared.calibrations:
            problem = "depths are uncalibrated: teach them in Set up, or choose a calibration there"
        elif prepared.skin.layer is None:
            problem = 'the skin file does not give the layer: add layer = "3 mm" to [surface]'
        page.post(DentNow(problem=problem).json)
        (self.pages.add if request.on else self.pages.discard)(page)

    def of(self, result: FrameResult) -> DentMap | None:
        """The dent of its touches; None where nothing touches, or depths are not known."""
        layer, nodes = self._runner.prepared.skin.layer, self._runner.prepared.mesh.points
        if layer is None or not result.touches:
            return None
        return dent_map([touch.detection for touch in result.touches], nodes[:, :2], layer)
