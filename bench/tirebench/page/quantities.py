"""What is shown of a turn; kept apart so that the page's process loads no estimator."""

UNITS = {"Fz": "N", "alpha": "deg", "kappa": "1", "Fy": "N"}
"""Unit of each quantity, as a document has it."""
DIGITS = {"Fz": 0, "alpha": 2, "kappa": 4, "Fy": 0}
"""Decimal places that are shown."""
NORMAL_95 = 1.959964
"""Half width of a 95 % band in standard deviations."""
