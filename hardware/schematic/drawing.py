"""A drawing as SVG: the symbols that the schematic needs, and lines between them."""

from __future__ import annotations

from dataclasses import dataclass, field

_HEAD = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w} {h}" width="{w}" height="{h}">\n'
    '<rect width="{w}" height="{h}" fill="white"/>\n'
    '<g fill="none" stroke="#223" stroke-width="1.6" font-family="sans-serif" font-size="13">\n'
)


@dataclass
class Sheet:
    """One drawing, w by h pixels; every method adds to it."""

    w: int
    h: int
    parts: list[str] = field(default_factory=list)

    def wire(self, *points: tuple[float, float]) -> None:
        """A line by way of the points."""
        path = " ".join(f"{x:g},{y:g}" for x, y in points)
        self.parts.append(f'<polyline points="{path}"/>')

    def dot(self, x: float, y: float) -> None:
        """A joint."""
        self.parts.append(f'<circle cx="{x:g}" cy="{y:g}" r="3" fill="#223"/>')

    def text(self, x: float, y: float, words: str, anchor: str = "start") -> None:
        """Words."""
        words = words.replace("&", "&amp;").replace("<", "&lt;")
        style = f'fill="#223" stroke="none" text-anchor="{anchor}"'
        self.parts.append(f'<text x="{x:g}" y="{y:g}" {style}>{words}</text>')

    def box(self, x: float, y: float, w: float, h: float, *lines: str) -> None:
        """A block with lines of text in it."""
        self.parts.append(f'<rect x="{x:g}" y="{y:g}" width="{w:g}" height="{h:g}" rx="3"/>')
        top = y + h / 2 - 8.5 * (len(lines) - 1) + 5
        for number, line in enumerate(lines):
            self.text(x + w / 2, top + 17 * number, line, "middle")

    def resistor(self, x: float, y: float, value: str, *, across: bool = False) -> None:
        """40 long from (x, y), downwards or across."""
        if across:
            self.parts.append(f'<rect x="{x:g}" y="{y - 6:g}" width="40" height="12"/>')
            self.text(x + 20, y - 11, value, "middle")
        else:
            self.parts.append(f'<rect x="{x - 6:g}" y="{y:g}" width="12" height="40"/>')
            self.text(x + 11, y + 25, value)

    def capacitor(self, x: float, y: float, value: str) -> None:
        """To ground from (x, y), 30 long."""
        self.wire((x, y), (x, y + 12))
        self.wire((x - 10, y + 12), (x + 10, y + 12))
        self.wire((x - 10, y + 18), (x + 10, y + 18))
        self.wire((x, y + 18), (x, y + 30))
        self.ground(x, y + 30)
        self.text(x + 15, y + 20, value)

    def ground(self, x: float, y: float) -> None:
        """Ground, below (x, y)."""
        for number, half in enumerate((10, 6, 2)):
            self.wire((x - half, y + 4 * number), (x + half, y + 4 * number))

    def rail(self, x: float, y: float, name: str) -> None:
        """A supply, above (x, y)."""
        self.wire((x - 10, y), (x + 10, y))
        self.text(x, y - 5, name, "middle")

    def fet(self, x: float, y: float, name: str, *, p: bool = False) -> None:
        """Channel from (x, y) to (x, y + 40), gate at (x - 32, y + 20)."""
        self.wire((x, y), (x, y + 8), (x - 14, y + 8))
        self.wire((x, y + 40), (x, y + 32), (x - 14, y + 32))
        self.wire((x - 14, y + 3), (x - 14, y + 37))
        self.wire((x - 20, y + 6), (x - 20, y + 34))
        self.wire((x - 20, y + 20), (x - 32, y + 20))
        tip = (x - 13, x - 6) if not p else (x - 1, x - 8)
        at = y + 8 if p else y + 32
        away = [(tip[1], at - 4), (tip[0] if p else x - 1, at), (tip[1], at + 4)]
        self.wire(*away)
        self.text(x + 8, y + 25, name)

    def amplifier(self, x: float, y: float, name: str) -> None:
        """Triangle: + at (x, y + 15), - at (x, y + 45), output at (x + 56, y + 30)."""
        self.parts.append(f'<polygon points="{x:g},{y:g} {x:g},{y + 60:g} {x + 56:g},{y + 30:g}"/>')
        self.text(x + 4, y + 20, "+")
        self.text(x + 4, y + 49, "−")
        self.text(x + 22, y - 2, name)

    def svg(self) -> str:
        """The file."""
        head = _HEAD.format(w=self.w, h=self.h)
        return head + "\n".join(self.parts) + "\n</g>\n</svg>\n"
