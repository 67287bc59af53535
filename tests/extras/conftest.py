"""What tests of extras may rely on."""

from __future__ import annotations

from cli.conftest import tomoskin

__all__ = ["tomoskin"]
