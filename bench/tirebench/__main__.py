"""``python -m tirebench``: the same as ``tirebench``."""

from tirebench.cli import main

if __name__ == "__main__":
    main()
