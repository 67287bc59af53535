"""Recordings: read, import, write; pictures and files of their images."""

from tomoskin.session.interchange import write_interchange
from tomoskin.session.reader import read_recording
from tomoskin.session.recording import Recording

__all__ = ["Recording", "read_recording", "write_interchange"]
