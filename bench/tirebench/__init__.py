"""The bench: the numerical rig and, beside it, the wheel transmitter's links."""
