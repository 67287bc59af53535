"""The board's schematic as a program: parts, circuit with its rule check, assemblies, netlist."""
