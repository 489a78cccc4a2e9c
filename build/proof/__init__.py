"""Proof of the intervals of an identification on the numerical rig."""
