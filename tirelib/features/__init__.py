"""Features of each turn and gage: edges, peaks, integrals, symmetry."""

from tirelib.features.extract import Features, extract_features
from tirelib.features.table import feature_frame

__all__ = ["Features", "extract_features", "feature_frame"]
