"""Live estimates from frames of strain: the same code and the same numbers as a whole record.

`StreamEstimator` pushes frames of any length through `TurnCutter`, `extract_features` and
`Calibration.estimate`. It adds what only a live signal needs: the age of the last estimate, a
watchdog for contacts that stay away, and its whole state as JSON. Numpy and scipy only, so the same
modules run inside an FMU.
"""

from tirelib.stream.estimator import StreamEstimator, TurnEstimate

__all__ = ["StreamEstimator", "TurnEstimate"]
