"""The build hook: each install holds the built page, wheel and sdist the built firmware too."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

sys.path.insert(0, str(Path(__file__).resolve().parent / "scripts"))
import images
import page as page_build


class PageHook(BuildHookInterface[Any]):
    """Builds the page with Vite, with a Node of its own where the machine has none."""

    def dependencies(self) -> list[str]:
        """Ask for Node from the Python registry only where the page is stale and none works."""
        if self._page.fresh() or page_build.find_node():
            return []
        return [page_build.NODE_REQUIREMENT]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
        """Build the page, or end the build with one sentence that says why not; the firmware."""
        try:
            page_build.build(self._page)
        except page_build.PageError as error:
            sys.exit(f"tomoskin: {error}")
        if version == "editable":  # of a checkout, which builds what it flashes
            return
        try:
            images.build(Path(self.root))
        except images.ImageError as error:
            self.app.display_warning(f"tomoskin: firmware in this build: {error}")

    @property
    def _page(self) -> page_build.Page:
        return page_build.Page.of(Path(self.root))
