"""Imaging by iteration: absolute, segmented, and difference images with sharp edges."""
