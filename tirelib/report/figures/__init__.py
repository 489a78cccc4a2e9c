"""The figures of the dissertation's chapter 4, redrawn from our data, and a few of our own."""

from tirelib.report.figures.cornering import figure_4_3, figure_4_20, figure_4_23
from tirelib.report.figures.lateral_force import figure_4_12, figure_4_14
from tirelib.report.figures.overview import figure_4_8, figure_accuracy, figure_residuals
from tirelib.report.figures.regression import figure_4_4, figure_4_5, figure_4_7

__all__ = [
    "figure_4_3",
    "figure_4_4",
    "figure_4_5",
    "figure_4_7",
    "figure_4_8",
    "figure_4_12",
    "figure_4_14",
    "figure_4_20",
    "figure_4_23",
    "figure_accuracy",
    "figure_residuals",
]
