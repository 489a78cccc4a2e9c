"""``python -m bench``: the same as ``tirebench``."""

from bench.cli import main

main()
