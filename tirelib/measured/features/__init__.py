"""Features of each turn and gage: edges, peaks, integrals, symmetry."""

from tirelib.measured.features.extract import Features, extract_features
from tirelib.measured.features.records import RecordReader, concatenate_features, features_of_record

__all__ = [
    "Features",
    "RecordReader",
    "concatenate_features",
    "extract_features",
    "features_of_record",
]
