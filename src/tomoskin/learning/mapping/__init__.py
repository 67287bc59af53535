"""How wires meet electrodes, from a handful of labelled presses."""
