"""A body that moves under the skin: what its motion does to the voltages, and its state."""
