"""The command line: one module a command, and one line in ``app`` for each; what extras make theirs
of."""

from tomoskin.cli.app import main as main
from tomoskin.cli.named_files import Reads as Reads
