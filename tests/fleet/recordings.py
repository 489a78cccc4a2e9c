"""A drive of a made-up tire as MDF 4 files: gaps, wheels, conditions on clocks of their own."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import numpy.typing as npt
from asammdf import MDF, Signal

from tests.synthetic import LATERAL, waveform

FloatArray = npt.NDArray[np.float64]
RATE = 2000.0
RADIUS = 0.305


def speed_at(time: FloatArray) -> FloatArray:
    """Speed of the drive, [m/s]: between 14 and 22 over a minute."""
    return np.asarray(18.0 + 4.0 * np.sin(2.0 * np.pi * time / 60.0))


def distance(time: FloatArray) -> FloatArray:
    return np.asarray(18.0 * time + 4.0 * 60.0 / (2.0 * np.pi) * (1 - np.cos(time * np.pi / 30)))


def strain_at(time: FloatArray, load: float, seed: int) -> FloatArray:
    """Strain of the five gages, shape (5, n)."""
    phi = 1.0 + distance(time) / (RADIUS + 0.005 - 1e-6 * load)
    half = 0.04 + 2.6e-5 * load
    rng = np.random.default_rng(seed)
    one = waveform(phi, half=half, dip=1e-3 + 3e-7 * load) + 2.7e-3
    return np.stack([one + 4e-6 * rng.standard_normal(time.size) for _ in LATERAL])


def write_drive(
    path: Path,
    *,
    seconds: float,
    wheels: Sequence[str] = ("FL",),
    loads: Sequence[float] = (4000.0,),
    gaps: Sequence[tuple[float, float]] = (),
    start: float = 1.78e9,
    part: float = 60.0,
) -> None:
    """Write one file, a part at a time; `gaps` are times between which nothing was recorded."""
    with MDF(version="4.10") as mdf:
        mdf.start_time = datetime.fromtimestamp(start, UTC)
        first = True
        for begin in np.arange(0.0, seconds, part):
            end = min(begin + part, seconds)
            time = np.arange(round(begin * RATE), round(end * RATE)) / RATE
            for low, high in gaps:
                time = time[(time < low) | (time >= high)]
            slow = np.arange(round(begin * 10), round(end * 10)) / 10.0
            every = []
            for wheel, load in zip(wheels, loads, strict=True):
                strain = strain_at(time, load, seed=int(begin))
                every.append(
                    [
                        Signal(
                            np.round(1e6 * row).astype(np.int16),
                            time,
                            unit="ustrain",
                            name=f"{wheel}_strain_{k}",
                        )
                        for k, row in enumerate(strain, start=1)
                    ]
                )
            every.append([Signal(3.6 * speed_at(slow), slow, unit="km/h", name="vehicle_speed")])
            rare = np.arange(begin, end, 5.0)
            every.append(
                [
                    Signal(np.full(rare.size, 2.3), rare, unit="bar", name=f"{wheel}_pressure")
                    for wheel in wheels
                ]
            )
            for index, signals in enumerate(every):
                if first:
                    mdf.append(signals, common_timebase=True)
                else:
                    clock = signals[0].timestamps
                    mdf.extend(index, [(clock, None), *((s.samples, None) for s in signals)])
            first = False
        mdf.save(path, overwrite=True)


def describe(folder: Path, wheels: Sequence[str] = ("FL",)) -> Path:
    """Write the recording.toml of such a drive."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = ['format = "tirelib-recording/1"', 'name = "commute"', 'axes = "iso"']
    for wheel in wheels:
        lines += [
            f"[wheels.{wheel}]",
            'tire = "made-up tire"',
            f"lateral_m = {list(LATERAL)}",
            f'strain = "{wheel}_strain_{{}}"',
            f"[wheels.{wheel}.conditions]",
            'speed = "vehicle_speed"',
            f'pressure = {{ channel = "{wheel}_pressure", hold_s = 60 }}',
        ]
    (folder / "recording.toml").write_text("\n".join(lines) + "\n")
    return folder
