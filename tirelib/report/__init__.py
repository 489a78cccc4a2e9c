"""Everything a person looks at: figures, pages, accuracy tables.

Plots speak as engineers do (N, deg, mm, microstrain, km/h) and name their axis system;
all else is SI.
"""
