"""What a user writes of a bench: the setup file and the sources in it."""
