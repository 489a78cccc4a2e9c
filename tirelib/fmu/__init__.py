"""The estimator as an FMU: what runs inside it, how it is built, how a campaign is played to it.

`variables` and `wheel` run inside the FMU and need numpy and scipy only; `bundle`, `describe` and
`build` make it with pythonfmu; `run` steps it with FMPy.
"""
