"""Recordings of other instruments and programs, and a skin file guessed from one."""
