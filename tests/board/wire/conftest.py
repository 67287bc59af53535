"""Hypothesis without a time limit per example: cores are shared with whatever else runs."""

from hypothesis import settings

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")
