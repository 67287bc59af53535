"""Bends told apart from touches: their directions in the data, their angle, their references."""
