"""The skin file: outline, electrodes, material, drive, readout, mesh and settings; strict."""

from tomoskin.skin.page import skin_file_page
from tomoskin.skin.settings import InverseSettings, ReadoutSettings, TouchSettings
from tomoskin.skin.skin import Skin

__all__ = ["InverseSettings", "ReadoutSettings", "Skin", "TouchSettings", "skin_file_page"]
