"""One tire of the proof: identified, held against the laboratory and against runs left out."""

import hashlib
import json
import time
from pathlib import Path
from typing import Any

import numpy as np

from proof.laboratory import CREEP, laboratory, press
from proof.tires import CACHE, measured
from tirelib.core.arrays import BoolArray, FloatArray
from tirelib.core.parameters import Tire
from tirelib.effects.state import Operating
from tirelib.inference.identify.campaign_data import straight_runs
from tirelib.inference.identify.identify import estimates_of, fitted
from tirelib.measured.signal import LowPass
from tirelib.measured.waveforms import Waveforms
from tirelib.model.base import operating_points, values_of
from tirelib.model.solution import solved
from tirelib.rig.solve import inflated
from tirelib.rig.tire import RigTire

LOAD, PRESSURE = 4800.0, 2.1e5
"""Load and pressure of the press test."""
HELD_OUT_EVERY = 4
"""Seeds that are identified twice more without some runs, to save time."""


def fingerprint() -> str:
    """Return a hash of the code that a result depends on."""
    root = Path(__file__).parents[2] / "tirelib"
    names = (
        "identify",
        "waveform_fit",
        "whiten_runs",
        "waveform_problem",
        "discrepancy",
        "structure",
        "campaign_data",
        "noise",
        "random_effects",
    )
    files = [root / "inference" / "identify" / f"{name}.py" for name in names]
    files += [root / "model" / f"{name}.py" for name in ("base", "chain", "solution")]
    files += [root / "model" / "rolled.py", root / "effects" / "state.py"]
    files += sorted((root / "physics" / "rolling").glob("*.py"))
    return _hash(*files, Path(__file__), *_LABORATORY)


_LABORATORY = tuple(Path(__file__).parent / f"{name}.py" for name in ("laboratory", "tires"))


def _hash(*files: Path) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def tests_of(seed: int, tire: RigTire, pressure: float) -> dict[str, Any]:
    """Return what the laboratory measures on a tire; kept apart, for it knows no estimator."""
    file = CACHE / f"lab{seed}.json"
    mark = _hash(*_LABORATORY)
    if file.exists():
        stored: dict[str, Any] = json.loads(file.read_text())
        if stored["fingerprint"] == mark and stored["pressure"] == pressure:
            return stored
    found = laboratory(tire, pressure)
    made = {
        "fingerprint": mark,
        "pressure": pressure,
        "values": found.values,
        "modal": found.modal,
        "press": press(tire, PRESSURE, LOAD),
    }
    file.write_text(json.dumps(made, indent=1))
    return made


def case(seed: int) -> dict[str, Any]:
    """Return the result of a seed, from the cache if neither it nor the code has changed."""
    file = CACHE / f"case{seed}.json"
    mark = fingerprint()
    if file.exists():
        stored: dict[str, Any] = json.loads(file.read_text())
        if stored["fingerprint"] == mark:
            return stored
    made = _make(seed) | {"fingerprint": mark}
    file.write_text(json.dumps(made, indent=1))
    return made


def _make(seed: int) -> dict[str, Any]:
    data = measured(seed)
    runs = straight_runs(data.waves)
    began = time.perf_counter()
    start, fit = fitted(runs)
    estimates = estimates_of(start, fit)
    took = time.perf_counter() - began
    pressure = start.tire.pressure
    found = tests_of(seed, data.tire, pressure)
    own = definition(data.tire, pressure)
    model = vertical_stiffness(start.tire.changed(**{e.name: e.value for e in estimates}))
    return {
        "seed": seed,
        "runs": len(runs.waves),
        "seconds": took,
        "rms_share": fit.rms / float(np.sqrt(np.mean(runs.strain**2))),
        "parameters": {
            e.name: {
                "value": e.value,
                "low": e.low,
                "high": e.high,
                "fit_std": e.fit_std,
                "flags": list(e.flags),
                "laboratory": found["values"].get(e.name, own[e.name]),
                "definition": own[e.name],
            }
            for e in estimates
        },
        "modal": found["modal"],
        "vertical_stiffness": {"model": model, "laboratory": found["press"]},
        "held_out": held_out(data.waves) if seed % HELD_OUT_EVERY == 0 else None,
    }


def definition(tire: RigTire, pressure: float) -> dict[str, float]:
    """Return the constants of a rig tire by the ring's names."""
    return {
        "bending_stiffness": tire.bending,
        "radial_stiffness": tire.radial_stiffness(pressure),
        "radial_pressure_slope": tire.sidewall_radial,
        "tangential_stiffness": tire.tangential_stiffness(pressure),
        "tangential_pressure_slope": tire.sidewall_tangential,
        "tread_stiffness": tire.tread_normal * tire.belt_width,
        "innerliner_offset": tire.innerliner_offset,
        "extension_stiffness": tire.extension,
        "shear_stiffness": tire.shear,
        "rotary_inertia": 0.0,
        "section_pull": grown_pull(tire, pressure),
        "liner_share": 0.0,
        "offset_pressure_slope": 0.0,
        "tread_poisson": 0.0,
        "contact_crown": 0.0,
        "creep": 0.0,
        "tread_spread": 0.0,
        "centrifugal_tension": 1.0,
        "tread_shear_stiffness": tire.tread_shear_x * tire.belt_width * (tire.friction > 0.0),
        "tread_hardening": tire.tread_hardening,
    }


def grown_pull(tire: RigTire, pressure: float) -> float:
    """Return the share of p b that the sidewalls of the grown belt take, pulled along by it."""
    grown = inflated(tire, pressure, 0.0)
    return tire.radial_stiffness(pressure) * grown / (pressure * tire.belt_width)


def vertical_stiffness(tire: Tire) -> float:
    """Return the slope of load over deflection of a model at the press test, [N/m]."""
    loads = LOAD * np.array([0.99, 1.01])
    none = np.zeros(2)
    press = Operating(
        load=loads,
        pressure=np.full(2, PRESSURE),
        omega=np.full(2, CREEP / tire.ring_radius),
        speed=np.full(2, CREEP),
        camber=none,
        slip_angle=none,
        slip_ratio=none,
        side_force=none,
        drive_force=none,
        order=none,
        temperature=np.full(2, np.nan),
    )
    depth = solved(values_of(tire), press, low_pass=LowPass()).deflection
    return float(np.diff(loads)[0] / np.diff(depth)[0])


def held_out(waves: Waveforms) -> dict[str, float]:
    """Return the strain error of runs left out, relative to that of the fitted ones."""
    load, pressure = waves.conditions["Fz"], waves.conditions["pressure"]
    sets = {
        "load 150 %": np.isclose(load, 1.5 * LOAD, rtol=0.05),
        "pressure 2.5 bar": np.isclose(pressure, 2.5e5, rtol=0.03),
    }
    return {name: _ratio(waves, out) for name, out in sets.items()}


def _ratio(waves: Waveforms, out: BoolArray) -> float:
    kept = straight_runs(waves.take(~out))
    _, fit = fitted(kept)
    rest = straight_runs(waves.take(~out | out))
    points = operating_points(rest.waves)
    wave = solved(fit.values, points, low_pass=rest.waves.low_pass).waveform
    error = np.mean((wave - rest.strain) ** 2, axis=1)
    share: FloatArray = error / np.mean(rest.strain**2, axis=1)
    return float(np.sqrt(share[out].mean() / share[~out].mean()))
