"""A synthetic wheel's strain through a strain tire in FMPy, step by step."""

import json
from typing import Any

import numpy as np

from tests.fmu import live
from tirelib.core.held import HELD
from tirelib.fmu.run import LoadedFmu


def held(**known: float) -> np.ndarray:
    """Conditions in the order of `HELD`; usual speed, pressure and camber unless told."""
    usual = {"speed": live.SPEED, "pressure": live.PRESSURE, "camber": 0.0}
    return np.array([{**usual, **known}.get(name, np.nan) for name in HELD])


CONDITIONS = held()


def strain(load: float = 4e3, tilt: float = 0.05, turns: float = 3.4) -> np.ndarray:
    found = live.strain_of(load, tilt, turns=turns)[0]
    return found[:, : found.shape[1] // 10 * 10]


def play(fmu: LoadedFmu, samples: np.ndarray, conditions: np.ndarray = CONDITIONS) -> list[Any]:
    """Outputs after every step, to the last digit."""
    seen = []
    for first in range(0, samples.shape[1], fmu.samples):
        fmu.step(samples[:, first : first + fmu.samples], conditions)
        seen.append(fmu.read())
    return seen


def play_from_start(fmu: LoadedFmu, samples: np.ndarray) -> Any:
    fmu.start(live.RATE)
    return play(fmu, samples)[-1]


def same(a: list[Any], b: list[Any]) -> bool:
    return json.dumps(a) == json.dumps(b)
