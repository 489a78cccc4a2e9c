"""Steady-state brush model and Magic Formula.

Inside the axes are ISO 8855 (TYDEX W): a positive slip angle gives a negative Fy, braking has a
negative slip ratio and a negative Fx.
"""
