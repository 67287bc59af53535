"""Newtons from labelled presses, and what a material remembers of its load."""
