"""Load, slip angle, slip ratio and lateral force from the features of a turn.

Predicting needs numpy only; fitting uses scipy as well.
"""
