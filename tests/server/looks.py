"""How a page looks: facts that hold in any browser, on any machine (``looks.js``)."""

from __future__ import annotations

import os
from pathlib import Path

from playwright.sync_api import TimeoutError as Overdue

SCRIPT = Path(__file__).with_suffix(".js")
"""Runs in a page before the page's own scripts."""

PICTURES = os.environ.get("TOMOSKIN_PICTURES")
"""A folder for pictures of all that is looked at, for a person's eyes."""

SETTLING = 30_000
"""Plots and messages come when they come, ms; only a page that looks wrong takes all of it."""

SCHEMES = ("light", "dark")


def look(page, name):
    """What is wrong with how the page looks, by fact, once it has settled."""
    try:
        page.wait_for_function(
            "() => !Object.keys(looks.faults()).length", timeout=SETTLING, polling=100
        )
        wrong = {}
    except Overdue:
        wrong = page.evaluate("looks.faults()")
    if PICTURES:
        page.screenshot(path=Path(PICTURES) / f"{name}.png")
    return wrong


def look_in_both(page, name):
    """The same in light and in dark."""
    found = {}
    for scheme in SCHEMES:
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        found |= {
            f"{scheme} {fact}": wrong for fact, wrong in look(page, f"{name}-{scheme}").items()
        }
    return found
