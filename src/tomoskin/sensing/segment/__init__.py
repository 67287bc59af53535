"""Regions of an image."""

from tomoskin.sensing.segment.region import Region, hexagonal_grid
from tomoskin.sensing.segment.segment import ImageNoise, Segmenter

__all__ = [
    "ImageNoise",
    "Region",
    "Segmenter",
    "hexagonal_grid",
]
