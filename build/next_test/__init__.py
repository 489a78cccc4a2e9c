"""Measures how often an advised next run tells look-alikes apart, on tires that are no ring."""
