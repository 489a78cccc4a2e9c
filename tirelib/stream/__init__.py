"""Live estimates from frames of strain: the same code and the same numbers as a whole record.

`StreamEstimator` cuts frames of any length into turns and estimates each. It adds what only a live
signal needs: the age of the last estimate, a watchdog for contacts that stay away, and its whole
state as JSON. The compiled core does it (`compiled`); `reference` does the same in numpy and scipy
only, and runs inside a Python FMU.
"""

from tirelib.stream.compiled import CompiledEstimator
from tirelib.stream.estimate import TurnEstimate
from tirelib.stream.estimator import StreamEstimator
from tirelib.stream.reference import NumpyEstimator

StreamEstimator.kinds = (CompiledEstimator, NumpyEstimator)
__all__ = ["StreamEstimator", "TurnEstimate"]
