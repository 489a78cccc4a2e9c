"""The estimator as an FMU: its content, its build, and the playing of a campaign to it.

`variables` and `wheel` run inside the FMU and need numpy and scipy only; `bundle`, `describe` and
`build` make it with pythonfmu; `run` steps it with FMPy.
"""
