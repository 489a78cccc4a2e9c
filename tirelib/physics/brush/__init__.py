"""Steady-state brush model, Magic Formula and tire property files (.tir).

Inside the axes are ISO 8855 (TYDEX W): a positive slip angle gives a negative Fy, braking has a
negative slip ratio and a negative Fx.
"""
