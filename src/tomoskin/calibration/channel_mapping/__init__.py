"""How wires meet electrodes, from a handful of labelled presses."""

from tomoskin.calibration.channel_mapping.mapping import ChannelMapping, ring_of
from tomoskin.calibration.channel_mapping.solve import SURE, MappingAnswer, solve_channel_mapping

__all__ = ["SURE", "ChannelMapping", "MappingAnswer", "ring_of", "solve_channel_mapping"]
