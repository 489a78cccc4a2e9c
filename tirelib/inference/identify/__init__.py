"""Tire parameters from campaigns, with intervals that hold the model's structural misfit."""
