"""The Pico's emulator: its one package, installed as its lock file pins it.

Prints the Node that runs it. Standard library only.
"""

from __future__ import annotations

import sys
from pathlib import Path

from page import Page, PageError, install, need_node

EMULATOR = Path(__file__).resolve().parent.parent / "firmware" / "pico" / "emulator"


def main() -> int:
    """Install unless all is there."""
    node = need_node()
    install(Page(EMULATOR, EMULATOR), node)
    print(node.program)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except PageError as error:
        sys.exit(f"the Pico's emulator: {error}")
