"""The skin file: outline, electrodes, material, drive, readout, mesh and settings; strict."""

from tomoskin.model.skin.body import ReadoutSettings as ReadoutSettings
from tomoskin.model.skin.build import SECTIONS as SECTIONS
from tomoskin.model.skin.find import read_text as read_text
from tomoskin.model.skin.hysteresis import (
    MaterialMemory as MaterialMemory,
    MemoryState as MemoryState,
    Metric as Metric,
    advanced as advanced,
    broken_down as broken_down,
    check_step as check_step,
    followed as followed,
    load_of as load_of,
)
from tomoskin.model.skin.lay import lay as lay
from tomoskin.model.skin.processing import (
    METHODS as METHODS,
    InverseSettings as InverseSettings,
    TouchSettings as TouchSettings,
    regions_doubt as regions_doubt,
)
from tomoskin.model.skin.skin import Skin as Skin
from tomoskin.model.skin.symmetry import Ambiguity as Ambiguity
