"""What the pages that run on this machine share: guard, connections, address, files, charts.

The live page of `tirebench` and the studio of `tirelib` are served by Starlette and uvicorn on a
socket of this machine. They need the packages of the extra `studio` or `bench`.
"""
