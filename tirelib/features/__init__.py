"""Features of each turn and gage: edges, peaks, integrals, symmetry."""

from tirelib.features.extract import Features, extract_features, features_of_record

__all__ = ["Features", "extract_features", "features_of_record"]
