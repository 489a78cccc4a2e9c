"""``python -m tirelib``: the same as the program ``tirelib``."""

from tirelib.cli import main

if __name__ == "__main__":
    main()
