"""Recordings of other instruments and programs, and a skin file guessed from one."""

from tomoskin.extras.instruments.guess import guess_skin as guess_skin, order_fault as order_fault
