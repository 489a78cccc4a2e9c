"""Where a model fails: its prediction against a campaign, in units of the repeats' noise."""

from tirelib.inference.compare.compare import QUANTITIES, compare
from tirelib.inference.compare.forces import ForceComparison
from tirelib.inference.compare.strain import Comparison

__all__ = ["QUANTITIES", "Comparison", "ForceComparison", "compare"]
