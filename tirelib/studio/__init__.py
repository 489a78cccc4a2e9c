"""The journey in the browser: ``tirelib studio``.

A server on this machine shows documents that the commands of `tirelib` write, and runs these
commands as processes. One kind of job is one command with its ``--json``, so that the page, the
command line and the tests share the numbers. All state is a session folder of readable files.
"""
