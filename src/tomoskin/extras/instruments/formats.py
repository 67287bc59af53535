"""The formats of other instruments and programs, in the order in which they are looked for."""

from __future__ import annotations

from tomoskin.extras.instruments import draeger, matlab, matrices, sciospec, sixteen, text_logs
from tomoskin.files.imports import Format

MATLAB = Format("a MATLAB file", "file", matlab.is_matlab, matlab.read_matlab)
DRAEGER = Format("a file of Dräger", "file", draeger.is_draeger, draeger.read_draeger)
SIXTEEN = Format("a tank of EIDORS", "arrays", sixteen.detects, sixteen.parse)
SOFT_SKINS = Format("a set of soft skins", "arrays", matrices.is_eskin, matrices.read_eskin)
KTC = Format("a tank of Kuopio", "arrays", matrices.is_ktc, matrices.read_ktc)
PYEIT = Format("arrays of pyEIT", "arrays", matrices.is_pyeit, matrices.read_pyeit)
OPEN_EIT = Format("a log of OpenEIT", "text", text_logs.is_open_eit, text_logs.read_open_eit)
EIT_KIT = Format("a log of EIT-kit", "text", text_logs.is_eit_kit, text_logs.read_eit_kit)
SCIOSPEC = Format("a file of Sciospec", "text", sciospec.is_sciospec, sciospec.read_sciospec)
SERIAL_LOG = Format("a serial log", "text", text_logs.is_serial_log, text_logs.read_serial_log)
