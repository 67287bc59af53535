"""Recordings: read, import, write; pictures and files of their images."""

from tomoskin.session.interchange import write_interchange
from tomoskin.session.picture import MOST_PANELS, Panel, write_picture
from tomoskin.session.reader import read_recording
from tomoskin.session.recording import Recording
from tomoskin.session.touch_csv import write_touches
from tomoskin.session.vtu import write_vtu

__all__ = [
    "MOST_PANELS",
    "Panel",
    "Recording",
    "read_recording",
    "write_interchange",
    "write_picture",
    "write_touches",
    "write_vtu",
]
