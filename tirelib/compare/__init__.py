"""Where a model fails: its prediction against a campaign, in units of the repeats' noise."""

from tirelib.compare.compare import QUANTITIES, compare
from tirelib.compare.forces import ForceComparison
from tirelib.compare.strain import Comparison

__all__ = ["QUANTITIES", "Comparison", "ForceComparison", "compare"]
