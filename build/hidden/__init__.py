"""Benchmark of the diagnosis on effects that the numerical rig hides."""
