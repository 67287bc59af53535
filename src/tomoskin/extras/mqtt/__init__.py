"""Touches and events as JSON for a broker of MQTT."""
