"""Noise from repeats, as the identification has it (`tirelib.identify.noise`)."""

from tirelib.identify.noise import RepeatNoise, repeat_noise

__all__ = ["RepeatNoise", "repeat_noise"]
