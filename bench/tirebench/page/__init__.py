"""The live page of ``tirebench run``: a process of its own, in the browser or in the terminal.

The run writes to a board in shared memory (`tirebench.live.board`) and waits for nobody; the
process of the page reads it at most 20 times a second. What it is too slow for, it misses, and
says so.
"""
