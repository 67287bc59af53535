"""The skin file: outline, electrodes, material, drive, readout, mesh and settings; strict."""

from tomoskin.model.skin.body import ReadoutSettings
from tomoskin.model.skin.build import SECTIONS
from tomoskin.model.skin.find import read_text
from tomoskin.model.skin.hysteresis import (
    MaterialMemory,
    MemoryState,
    Metric,
    advanced,
    broken_down,
    check_step,
    followed,
    load_of,
)
from tomoskin.model.skin.lay import lay
from tomoskin.model.skin.processing import (
    InverseSettings,
    TouchSettings,
    regions_doubt,
)
from tomoskin.model.skin.skin import Skin

__all__ = [
    "SECTIONS",
    "InverseSettings",
    "MaterialMemory",
    "MemoryState",
    "Metric",
    "ReadoutSettings",
    "Skin",
    "TouchSettings",
    "advanced",
    "broken_down",
    "check_step",
    "followed",
    "lay",
    "load_of",
    "read_text",
    "regions_doubt",
]
