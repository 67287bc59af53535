"""Skins whose images it makes."""

from pathlib import Path

TANK_16 = Path(__file__).parent / "tank-16.toml"
