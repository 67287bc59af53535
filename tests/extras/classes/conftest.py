"""The examples, for tests of those that classify."""

from __future__ import annotations

from examples.conftest import imported, published

__all__ = ["imported", "published"]
