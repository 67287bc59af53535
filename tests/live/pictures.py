"""What a page looks like, coarsely enough to be the same on every machine: where its parts stand,
and the mean colours of a grid over the screenshot."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass

import matplotlib.image
import numpy as np

PARTS = (
    ("top", "header.top"),
    ("sheet", "[data-testid=sheet]"),
    ("legend", ".legend"),
    ("tabs", ".tabs"),
    ("side", ".side"),
    ("drawer", "#drawer"),
    ("drawer's plot", "#drawer .plot"),
    ("drawer's form", "#drawer form, #drawer fieldset, #drawer details, #drawer select"),
    ("controls", "footer.controls"),
)
ACROSS = 24
"""Cells of the grid across the page; they are square, nearly."""

NEAR_PLACE = 0.02
"""Of the page's width or height, by which a part may stand elsewhere: fonts differ."""

NEAR_COLOUR = 10
FEW_CELLS = 0.05
"""Levels of 255 by which a cell's colour may differ, and the part of all cells that may differ by
more: figures change (0.6 % of the cells from run to run), and fonts (4.8 % with a serif one)."""

STANDS = """parts => parts.map(([, selector]) => {
    const box = document.querySelector(selector)?.getBoundingClientRect();
    return box ? [box.x / innerWidth, box.y / innerHeight, box.width / innerWidth,
        box.height / innerHeight] : null;
})"""
CUT_OFF = """() => {
    const parts = '.drawn, .drawn *, .panel, .top, .controls, .tabs';
    const hides = e => {
        const { textOverflow, display } = getComputedStyle(e);
        return textOverflow !== 'ellipsis' && display !== 'inline'
            && !e.matches('input, select') && !e.closest('.u-wrap, svg, .unseen');
    };
    return [...document.querySelectorAll(parts)]
        .filter(e => e.clientWidth > 1 && e.scrollWidth > e.clientWidth + 1 && hides(e))
        .map(e => e.className || e.tagName);
}"""
SMALLEST = """selector => Math.min(...[...document.querySelectorAll(selector)]
    .map(e => parseFloat(getComputedStyle(e).fontSize)))"""


@dataclass(frozen=True)
class Look:
    """Parts by name with x, y, width, height in parts of the page; (rows, cells, 3) levels."""

    parts: dict[str, list[float]]
    colours: np.ndarray

    @classmethod
    def of(cls, page):
        stands = page.evaluate(STANDS, PARTS)
        names = [name for name, _ in PARTS]
        parts = {name: box for name, box in zip(names, stands, strict=True) if box is not None}
        return cls(parts, coarse(page.screenshot()))

    @classmethod
    def read(cls, told):
        rows = [np.frombuffer(base64.b64decode(row), np.uint8) for row in told["colours"]]
        return cls(told["parts"], np.array(rows).reshape(len(rows), -1, 3))

    def told(self):
        parts = {name: [round(part, 3) for part in box] for name, box in self.parts.items()}
        rows = [base64.b64encode(row.tobytes()).decode() for row in self.colours]
        return {"parts": parts, "colours": rows}

    def differs(self, other):
        """In words, from the ``other`` one; nothing where they are alike."""
        if self.parts.keys() != other.parts.keys():
            return f"parts {sorted(self.parts)}, expected {sorted(other.parts)}"
        for name, box in self.parts.items():
            off = np.abs(np.subtract(box, other.parts[name])).max()
            if off > NEAR_PLACE:
                return f"{name} stands at {np.round(box, 3)}, expected {other.parts[name]}"
        if self.colours.shape != other.colours.shape:
            return f"grid of {self.colours.shape}, expected {other.colours.shape}"
        off = np.abs(self.colours.astype(int) - other.colours).max(axis=-1) > NEAR_COLOUR
        if off.mean() > FEW_CELLS:
            return f"other colours in {100 * off.mean():.0f} % of the cells (row, cell): " + str(
                np.argwhere(off)[:12].tolist()
            )
        return ""


def coarse(png):
    """(rows, ACROSS, 3) mean levels of a screenshot's cells."""
    image = matplotlib.image.imread(io.BytesIO(png), format="png")[..., :3]
    height, width = image.shape[:2]
    down = round(ACROSS * height / width)
    rows = np.array_split(image, down)
    cells = [[cell.mean(axis=(0, 1)) for cell in np.array_split(row, ACROSS, 1)] for row in rows]
    return np.round(255 * np.array(cells)).astype(np.uint8)
