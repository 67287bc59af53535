"""Amounts of a touch from labelled presses, force or depth, and what materials remember."""
