"""The commands, for tests of files that they write."""

from cli.conftest import tomoskin

__all__ = ["tomoskin"]
