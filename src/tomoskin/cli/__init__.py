"""The command line: one module a command, and one line in ``app`` for each."""

from tomoskin.cli.app import main as main
