"""Error of the load while the speed changes, over a T / (2 v): ``python build/ramp_error.py``.

The virtual tire rolls straight at a held load and brakes or accelerates evenly; its strain goes
through the calibration of the co-simulations. "Even turn" is wheel angle as time times the mean
rate of the preceding turn. Writes ``docs/theory/ramp_error.png`` and prints the tables of the
largest errors, of steps and of slip ratios in ``docs/theory/estimates_measured.md``.
"""

import sys
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from matplotlib.figure import Figure

from tirelib.core.compiled import choose_numpy
from tirelib.core.threads import one_thread
from tirelib.estimators.calibration_file import read_calibration
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.spec import default_surface
from tirelib.fmu.virtual.surface import read_surface
from tirelib.fmu.virtual.wheel import VirtualWheel
from tirelib.measured.features.extract import extract_features
from tirelib.measured.signal import LowPass, angle, cut_turns, slip, turns
from tirelib.measured.signal.angle import angle_law

ROOT = Path(__file__).parents[1]
RATE, SAMPLES = 1e4, 20
CALIBRATION = read_calibration(ROOT / "build/cosim/calibration.toml")
SURFACE = read_surface(default_surface())
RESTING = {
    "Fz": 4000.0,
    "alpha": 0.0,
    "kappa": 0.0,
    "camber": 0.0,
    "speed": 20.0,
    "pressure": 2.3e5,
}
ROAD = {"friction": 1.0, "tread_depth": 8e-3, "tread_temperature": 300.0}
AS_CALIBRATED = {"friction": 0.95, "tread_depth": 8e-3, "tread_temperature": 313.15}
"""Road and tread on which the virtual tire and the calibration were made."""
STEADY = 0.5
"""Time before the speed begins to change, [s]."""


def play(seconds: float, law: Any) -> dict[str, np.ndarray]:
    """Return strain, turn rate and inputs of the virtual tire along a manoeuvre."""
    wheel = VirtualWheel(SURFACE, Options(rate=RATE, seed=1), SAMPLES)
    wheel.begin([{**RESTING, **law(0.0)}[name] for name in SURFACE.inputs])
    rows, strain = [], []
    for frame in range(int(seconds * RATE / SAMPLES)):
        inputs = {**RESTING, **law(frame * SAMPLES / RATE)}
        wheel.step(SAMPLES / RATE, [inputs[name] for name in SURFACE.inputs])
        reals = wheel.outputs()[0]
        strain.append(np.array(reals[: 5 * SAMPLES]).reshape(SAMPLES, 5))
        rows.append([*(inputs[name] for name in SURFACE.inputs), reals[5 * SAMPLES]])
    held = np.repeat(np.array(rows), SAMPLES, axis=0).T
    columns = dict(zip((*SURFACE.inputs, "omega"), held, strict=True))
    return {"strain": np.concatenate(strain).T, **columns}


def estimate(made: dict[str, np.ndarray], *told: str) -> Any:
    """Return features and estimates where these conditions are told."""
    held: Any = {name: made[name] for name in (*told, "pressure", "camber")}
    low_pass = LowPass(CALIBRATION.order, CALIBRATION.cut_off)
    found = cut_turns(made["strain"], RATE, CALIBRATION.lateral, low_pass=low_pass, **held)
    features = extract_features(found)
    return features, CALIBRATION.estimate(features)


def even(middle: float, turn: float, *_: Any, **__: Any) -> Any:
    """Return the law of a wheel that turns evenly."""
    return angle_law(middle, turn, 0.0, {}, ())


def ramp(acceleration: float, load: float, t: float) -> dict[str, float]:
    """Return the inputs of a ramp between 80 and 29 km/h."""
    first = 80.0 / 3.6 if acceleration < 0.0 else 8.0
    return {"Fz": load, "speed": first + acceleration * max(t - STEADY, 0.0)}


def draw() -> None:
    """Draw the error of every turn of all ramps; print the largest of each load, and in std."""
    found: dict[tuple[float, str], list[tuple[float, float]]] = {}
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True)
    for load, mark in ((2000.0, "o"), (4000.0, "s")):
        for acceleration in (-8.0, -6.0, -4.0, -2.0, 2.0, 4.0, 6.0, 8.0):
            made = play(STEADY + abs(14.0 / acceleration), partial(ramp, acceleration, load))
            made |= {name: np.full(made["Fz"].size, x) for name, x in AS_CALIBRATED.items()}
            with mock.patch.object(turns, "angle_law", even):
                before = estimate(made, "speed", *AS_CALIBRATED)
            for axes, color, (features, told) in (
                (left, "tab:red", before),
                (right, "tab:green", estimate(made, "speed", *AS_CALIBRATED)),
                (right, "tab:blue", estimate(made, "speed", "omega", *AS_CALIBRATED)),
            ):
                shape = "+" if color == "tab:blue" else mark
                late = (features.time > STEADY + 0.1) & told.turn_valid
                speed = np.interp(
                    features.time * RATE, np.arange(made["speed"].size), made["speed"]
                )
                x = 50.0 * acceleration * features.period / speed
                error = 100.0 * (told.value["Fz"] / load - 1.0)
                if axes is right:
                    over = np.abs(told.value["Fz"] - load) / told.std["Fz"]
                    pairs = zip(np.abs(error[late]), over[late], strict=True)
                    by = "speed, omega" if color == "tab:blue" else "speed"
                    found.setdefault((load, by), []).extend(pairs)
                axes.plot(x[late], error[late], shape, color=color, markersize=3, alpha=0.6)
    left.set(title="even turn", ylabel="error of Fz [%]", xlabel="a T / (2 v) [%]")
    right.set(
        title="wheel's own rate: + omega, o speed", xlabel="a T / (2 v) [%]", ylim=(-5.0, 5.0)
    )
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.axhspan(-3.0, 3.0, color="0.9", zorder=0)
    left.text(
        0.98,
        0.97,
        "circles 2 kN, squares 4 kN; grey: 3 %",
        transform=left.transAxes,
        ha="right",
        va="top",
        fontsize=8,
    )
    figure.savefig(ROOT / "docs/theory/ramp_error.png", dpi=110)
    for (load, by), rows in found.items():
        error, over = np.array(rows).max(axis=0)
        sys.stdout.write(f"| {load:g} N | {by} | {len(rows)} | {error:.1f} % | {over:.1f} |\n")


def steps() -> None:
    """Print the error of the first turns after a step, worst over when in the turn it comes."""
    changes = {
        "load 3 to 4 kN": {"Fz": (3000.0, 4000.0)},
        "slip angle 0 to 2 deg": {"alpha": (0.0, np.radians(2.0))},
        "slip ratio 0 to -0.05": {"kappa": (0.0, -0.05)},
    }
    for label, change in changes.items():
        for told in (("speed", "omega"), ("speed",)):
            rows: dict[int, list[Any]] = {}
            for phase in np.linspace(0.0, 1.0, 9)[:-1]:
                at = 0.6 + 0.097 * phase
                made = play(1.3, partial(_step, change, at))
                features, found = estimate(made, *told)
                first = int(np.argmax(features.time > at))
                for turn in range(4):
                    row = first + turn
                    here = min(int(features.time[row] * RATE), made["Fz"].size - 1)
                    truth = {
                        "Fz": made["Fz"][here],
                        "alpha": made["alpha"][here],
                        "kappa": made["kappa"][here],
                    }
                    rows.setdefault(turn, []).append(
                        (*(found.value[q][row] - truth[q] for q in truth), found.turn_valid[row])
                    )
            for turn, values in rows.items():
                table = np.array([value[:3] for value in values if value[3]])
                worst = np.abs(table).max(axis=0) if len(table) else np.full(3, np.nan)
                worst[1] = np.degrees(worst[1])
                numbers = [f"{value:.4f}" for value in worst]
                cells = (label, ", ".join(told), str(turn + 1), *numbers, str(len(table)))
                sys.stdout.write(f"| {' | '.join(cells)} |\n")


def brake(speed: float, begins: float, t: float) -> dict[str, float]:
    """Return the inputs of a brake that takes hold within 0.15 s."""
    x = min(max(t - begins, 0.0), 0.15)
    passed = 0.5 * x**2 / 0.15 + max(t - begins - 0.15, 0.0)
    return {"Fz": 3500.0, "speed": speed - 8.0 * passed, "kappa": -0.04 * x / 0.15}


def pulses(speed: float, begins: float, t: float) -> dict[str, float]:
    """Return the inputs of three pulses of the brake a second."""
    x, w = max(t - begins, 0.0), 6.0 * np.pi
    lost = 2.0 * (x - np.sin(w * x) / w)
    return {"Fz": 3500.0, "speed": speed - lost, "kappa": -0.025 * (1.0 - np.cos(w * x))}


def back(speed: float, begins: float, t: float) -> dict[str, float]:
    """Return the inputs of a slip ratio that grows evenly and turns round; the speed is held."""
    x = max(t - begins, 0.0)
    return {"Fz": 3500.0, "speed": speed, "kappa": -0.12 * max(min(x, 0.8 - x), 0.0)}


def begin(speed: float, begins: float, t: float) -> dict[str, float]:
    """Return the inputs of a slip ratio that begins to grow; the speed is held."""
    return {"Fz": 3500.0, "speed": speed, "kappa": -0.12 * min(max(t - begins, 0.0), 0.4)}


def leap(speed: float, begins: float, t: float) -> dict[str, float]:
    """Return the inputs of a slip ratio that jumps; the speed is held."""
    return {"Fz": 3500.0, "speed": speed, "kappa": 0.0 if t < begins else -0.03}


def press(speed: float, begins: float, t: float) -> dict[str, float]:
    """Return the inputs of a load that jumps."""
    return {"Fz": 3000.0 if t < begins else 4000.0, "speed": speed}


def slips() -> None:
    """Print the worst error of the slip ratio, itself and over its standard deviation."""
    for law in (brake, pulses, begin, leap, press):
        for told in (("speed", "omega"), ("speed",)):
            rows = []
            for speed, phase in product((12.0, 20.0), np.linspace(0.0, 1.0, 9)[:-1]):
                made = play(0.9, partial(law, speed, 0.4 + phase * 1.92 / speed))
                made |= {name: np.full(made["Fz"].size, x) for name, x in ROAD.items()}
                for factor in (0.5, 1.0, 2.0):
                    with mock.patch.object(slip, "PULL_SLIP", factor * slip.PULL_SLIP):
                        features, found = estimate(made, *told, *ROAD)
                    here = np.minimum((features.time * RATE).astype(int), made["Fz"].size - 1)
                    good = found.turn_valid & (np.arange(here.size) > 0)
                    error = np.abs(found.value["kappa"] - made["kappa"][here])[good]
                    over = error / found.std["kappa"][good]
                    rows.append((factor, error.max(), over.max()))
            table = np.array(rows)
            half, one, double = (table[table[:, 0] == x] for x in (0.5, 1.0, 2.0))
            cells = (
                law.__name__,
                ", ".join(told),
                f"{one[:, 1].max():.4f}",
                *(f"{x[:, 2].max():.1f}" for x in (half, one, double)),
            )
            sys.stdout.write(f"| {' | '.join(cells)} |\n")


def turning() -> None:
    """Print the estimates of a slip ratio that grows and turns round, from `speed` alone."""
    rows: dict[tuple[str, float], list[tuple[float, float]]] = {}
    for speed, phase in product((12.0, 20.0), np.linspace(0.0, 1.0, 9)[:-1]):
        begins = 0.4 + phase * 1.92 / speed
        made = play(1.4, partial(back, speed, begins))
        made |= {name: np.full(made["Fz"].size, x) for name, x in ROAD.items()}
        for factor in (0.5, 1.0, 2.0):
            with mock.patch.object(angle, "ENDS", factor * angle.ENDS):
                features, found = estimate(made, "speed", *ROAD)
            here = np.minimum((features.time * RATE).astype(int), made["Fz"].size - 1)
            error = np.abs(found.value["kappa"] - made["kappa"][here])
            onset = (features.time > begins) & (features.time - features.period <= begins)
            for label, use in (("it begins", onset), ("later", features.time > begins)):
                good = found.valid["kappa"] & use & (onset if label == "it begins" else ~onset)
                over = error[good] / found.std["kappa"][good]
                pairs = zip(error[good].tolist(), over.tolist(), strict=True)
                rows.setdefault((label, factor), []).extend(pairs)
    for (label, factor), values in rows.items():
        error, over = np.array(values).max(axis=0)
        sys.stdout.write(f"| {label} | {factor:g} | {error:.4f} | {over:.1f} |\n")


def _step(change: dict[str, tuple[float, float]], at: float, t: float) -> dict[str, float]:
    return {name: values[int(t >= at)] for name, values in change.items()}


if __name__ == "__main__":
    choose_numpy()  # constants of the compiled core cannot be changed
    with one_thread():
        turning()
        slips()
        steps()
        draw()
