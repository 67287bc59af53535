"""Voltages, touches and events as streams of LSL."""
