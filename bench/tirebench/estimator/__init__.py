"""Samples to estimates: the wheels of a run, the FMU that estimates, and the laps of its turns."""
