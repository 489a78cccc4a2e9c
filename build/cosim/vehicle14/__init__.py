"""A vehicle with 14 degrees of freedom: body 6, suspension 4, wheel spin 4.

The modules need numpy only and know each other by relative imports, so that an FMU can carry them
under a name of its own. The tires' law is handed in (`tire.BrushTires`).
"""
