"""Boards: bytes and messages, transports, the protocol session."""
