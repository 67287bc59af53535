"""Recordings of other programs and instruments, their electrodes and signs brought to ours."""
