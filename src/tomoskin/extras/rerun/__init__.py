"""The sheet in space, touches and series for Rerun's viewer, live or of a session."""
