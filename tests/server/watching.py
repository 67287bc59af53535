"""A page in real Chromium, as tests see and press it."""

from pathlib import Path

import numpy as np

from conftest import missing
from server.looks import SCRIPT

FLAGS = Path(__file__).resolve().parents[2] / "scripts" / "chromium.flags"
ARGUMENTS = FLAGS.read_text(encoding="utf-8").split()
PATIENCE = 300_000
AXE = Path(__file__).resolve().parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"
READ = """() => {
    const { image, touches, truths, referenceReady, sequence } = window.tomoskin.last;
    return { image: [...image], touches, truths, referenceReady, sequence };
}"""


TO_CLIENT = "([x, y]) => window.tomoskin.sheetToClient(x, y)"


class Watched:
    """A page of which everything that goes wrong is noted."""

    def __init__(self, browser, site, mesh, size=(1280, 720), *, touch=False):
        """``touch``: a screen that is pressed with fingers, without a mouse."""
        self.site, self._mesh = site, mesh
        self.wrong = []
        self.context = browser.new_context(
            viewport={"width": size[0], "height": size[1]},
            has_touch=touch,
            reduced_motion="reduce",
        )
        self.context.add_init_script(path=SCRIPT)
        self.page = self.context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.page.on("console", self._console)
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("requestfailed", self._failed)
        self.page.on("response", self._response)

    def _failed(self, request):
        if request.failure != "net::ERR_ABORTED":  # a page that is left asks whether it is refused
            self.wrong.append(f"{request.url}: {request.failure}")

    def open(self):
        self.page.goto(self.site.policy.address)
        self.until("last?.referenceReady")

    def until(self, condition):
        """Wait until ``condition`` of ``window.tomoskin`` holds."""
        self.page.wait_for_function(f"() => window.tomoskin && window.tomoskin.{condition}")

    def test_id(self, name):
        return self.page.get_by_test_id(name)

    def move(self, x, y):
        """Pointer over a place on the sheet, m: where it is once the page stands still."""
        before = None
        while (place := self.page.evaluate(TO_CLIENT, [x, y])) != before:
            self.page.mouse.move(place["x"], place["y"])
            before = place

    def press(self, x, y):
        """Pointer down there, until the twin feels it and a touch is shown."""
        self.move(x, y)
        self.page.mouse.down()
        self.until("last.truths.length > 0")
        self.until("last.touches.length > 0")

    def lifted(self):
        self.until("last.truths.length === 0")
        self.until("last.touches.length === 0")

    def read(self):
        return self.page.evaluate(READ)

    def extreme(self):
        """Centroid of the half-maximum region of the picture, m."""
        image = np.array(self.read()["image"])
        weight = np.where(image < 0.5 * image.min(), -image, 0.0) * self._mesh.volumes
        return weight @ self._mesh.centroids / weight.sum()

    def rows(self):
        """(n, 2) m: the places in the list, as a person reads them."""
        cells = self.test_id("touch-row").evaluate_all(
            "rows => rows.map(row => [...row.querySelectorAll('td')].map(td => td.innerText))"
        )
        return np.array([[number(row[0]), number(row[1])] for row in cells]).reshape(-1, 2) / 1e3

    def _console(self, message):
        if message.type == "error":
            self.wrong.append(message.text)

    def _response(self, response):
        if response.status >= 400:
            self.wrong.append(f"{response.status} {response.url}")


def number(text):
    return float(text.replace("−", "-").strip())


def distance(one, two):
    return float(np.hypot(*(np.asarray(one) - two)))


def axe_finds(page, *parts):
    """What axe-core objects to on the page, or in the ``parts`` of it that are named by CSS.

    Contrast is left to ``looks``, which reads canvases and drawings too.
    """
    if not AXE.is_file():
        missing("the page's accessibility: axe-core is not installed (make page)")
    if page.evaluate("typeof axe") == "undefined":
        page.evaluate(AXE.read_text())
    scope = {"include": [[part] for part in parts]} if parts else None
    rules = {"rules": {"color-contrast": {"enabled": False}}}
    found = page.evaluate("([scope, rules]) => axe.run(scope ?? document, rules)", [scope, rules])
    found = found["violations"]
    return [(v["id"], [node["target"] for node in v["nodes"]][:3]) for v in found]
