"""Priors: what is held to be likely of an image before there are data."""
