"""Regions of an image."""

from tomoskin.sensing.segment.region import Region as Region, hexagonal_grid as hexagonal_grid
from tomoskin.sensing.segment.segment import ImageNoise as ImageNoise, Segmenter as Segmenter
