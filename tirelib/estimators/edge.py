"""Units of estimates at the edge: documents, tables and pages say what engineers say.

A module of its own, because whatever only shows or records estimates has to start quickly.
"""

from math import pi

FORMAT = "tirelib-estimate/1"
EDGE_UNIT = {"Fz": ("N", 1.0), "alpha": ("deg", 180.0 / pi), "kappa": ("1", 1.0), "Fy": ("N", 1.0)}
"""Unit and factor of each quantity in the document."""
VARIED = {"Fz": 300.0, "alpha": 0.5, "kappa": 0.01, "Fy": 300.0}
"""Range below which a quantity stood still: R2 and a share of the range would say nothing."""
