"""A strain waveform in closed form, for tests of what reads waveforms. It is no tire model."""

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
LATERAL = (0.06, 0.03, 0.0, -0.03, -0.06)
RATE = 1e4


def wrapped(phi: FloatArray) -> FloatArray:
    """Wheel angle in [-pi, pi)."""
    return np.asarray((phi + np.pi) % (2.0 * np.pi) - np.pi)


def waveform(
    phi: FloatArray,
    *,
    half: float = 0.2,
    tension: float = 8e-3,
    dip: float = 3e-3,
    imbalance: float = 0.0,
    edge: float = 0.05,
) -> FloatArray:
    """Strain over wheel angle: a plateau with smooth edges at +-half, dips just outside."""
    x = wrapped(phi)
    plateau = 0.5 * (np.tanh((x + half) / edge) - np.tanh((x - half) / edge))
    before = np.exp(-(((x + half + 0.15) / 0.12) ** 2))
    after = np.exp(-(((x - half - 0.15) / 0.12) ** 2))
    dips = (dip - imbalance) * before + (dip + imbalance) * after
    return np.asarray(tension * plateau - dips)


def record(
    *,
    turns: float = 5.0,
    speed: float = 18.0,
    radius: float = 0.305,
    start: float = np.pi,
    half: float = 0.2,
    tension: float = 8e-3,
    dip: float = 3e-3,
    imbalance: float = 0.0,
    tilt: float = 0.0,
    offset: float = 2.7e-3,
    noise: float = 0.0,
    rate: float = RATE,
    gages: int = 5,
    seed: int = 0,
) -> tuple[FloatArray, npt.NDArray[np.bool_], float]:
    """Strain of several gages over time, the trigger, and the turn rate [rad/s].

    `tilt` makes contact length and dips grow over the lateral position, as a slip angle does.
    """
    omega = speed / radius
    n = int(turns * 2.0 * np.pi / omega * rate)
    phi = start + omega * np.arange(n) / rate
    rng = np.random.default_rng(seed)
    side = np.array(LATERAL[:gages]) / 0.06
    rows = [
        waveform(phi, half=half * (1 + tilt * s), tension=tension * (1 + 0.3 * tilt * s),
                 dip=dip * (1 + 2 * tilt * s), imbalance=imbalance)
        for s in side
    ]  # fmt: skip
    strain = np.stack(rows) + offset + noise * rng.standard_normal((gages, n))
    top = np.floor((phi - np.pi) / (2.0 * np.pi))
    trigger = np.concatenate(([False], np.diff(top) > 0.5))
    return strain, trigger, omega


def frames(n: int, longest: int, seed: int) -> list[slice]:
    """Cut n samples into frames of random lengths from 1 to `longest`."""
    rng = np.random.default_rng(seed)
    ends = np.cumsum(rng.integers(1, longest + 1, size=n))
    ends = np.append(ends[ends < n], n)
    return [slice(int(a), int(b)) for a, b in zip(np.append(0, ends[:-1]), ends, strict=True)]
