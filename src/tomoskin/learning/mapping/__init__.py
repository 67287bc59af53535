"""How wires meet electrodes, from a handful of labelled presses."""

from tomoskin.learning.mapping.mapping import ChannelMapping, ring_of
from tomoskin.learning.mapping.solve import SURE, MappingAnswer, solve_channel_mapping

__all__ = ["SURE", "ChannelMapping", "MappingAnswer", "ring_of", "solve_channel_mapping"]
