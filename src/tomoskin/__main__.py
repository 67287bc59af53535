"""``python -m tomoskin``: the command, where a shell does not find it by its name."""

from tomoskin.cli import main

main()
