"""``python -m bench``: the same as ``tirebench``."""

from bench.cli import main

if __name__ == "__main__":
    main()
