"""
The FMU in a vehicle loop
=========================

A vehicle model knows wheel loads and slips; a real car does not. Here a wheel brakes with a force
that follows the *estimated* load: the virtual tire makes strain out of the true state, the
estimator makes a load out of the strain, and the brake uses it. Both are FMUs (FMI 2.0
co-simulation), so any simulation tool can run the same loop.

You need tirelib with the extra ``fmu`` (:doc:`/howto/install`), and :download:`example_rig.py
<../tutorials/example_rig.py>` in the folder of this script.
"""

# %%
# Calibrate, and build both FMUs
# ------------------------------
#
# The brake needs traction in the calibration: five loads and four slip ratios. A whole car also
# leans, corners and drives at many speeds: ``tirelib fmu measure --out day`` measures the virtual
# tire over all that. In the shell, the rest is ``tirelib calibrate day --out cal.toml``,
# ``tirelib fmu build --calibration cal.toml --out StrainTire.fmu --samples-per-step 20`` and
# ``tirelib fmu virtual --out VirtualTire.fmu --samples-per-step 20``.

import shutil
import tempfile
from collections import Counter
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from example_rig import PRESSURE, measure
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

import tirelib
from tirelib.fmu.virtual.spec import build_virtual

folder = Path(tempfile.mkdtemp())
day = measure(
    folder / "day",
    [
        (load, 0.0, kappa)
        for load in (1500, 3000, 4500, 6000, 7500)
        for kappa in (-0.04, -0.02, 0.0, 0.02)
    ],
    seed=1,
)
trained = tirelib.train(tirelib.observe([day]))
tirelib.write_calibration(trained.calibration, folder / "cal.toml")
SAMPLES, RATE = 20, 1e4
tirelib.build_fmu(folder / "cal.toml", folder / "StrainTire.fmu", samples_per_step=SAMPLES)
build_virtual(folder / "VirtualTire.fmu", samples_per_step=SAMPLES)

# %%
# A few lines of FMPy
# -------------------
#
# Every master does this: instantiate, set parameters and inputs, step.


class Fmu:
    """One instance of an FMU whose variables are set and read by name."""

    def __init__(self, path):
        description = read_model_description(path)
        self.at = {v.name: v.valueReference for v in description.modelVariables}
        self.folder = extract(path)
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=path.stem,
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()

    def set(self, **values):
        self.slave.setReal([self.at[name] for name in values], list(values.values()))

    def get(self, *names):
        return self.slave.getReal([self.at[name] for name in names])

    def get_flag(self, name):
        return bool(self.slave.getBoolean([self.at[name]])[0])

    def set_flag(self, name, value):
        self.slave.setBoolean([self.at[name]], [value])

    def status(self):
        return self.slave.getString([self.at["status"]])[0].decode()

    def close(self):
        self.slave.terminate()
        self.slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


tire, strain = Fmu(folder / "VirtualTire.fmu"), Fmu(folder / "StrainTire.fmu")
frame = [f"strain_{sample}_{gage}" for sample in range(1, SAMPLES + 1) for gage in range(1, 6)]

# %%
# The loop
# --------
#
# The load swings between 3 and 5 kN, as on a wavy road; after 0.8 s the driver asks for a braking
# force of 20 % of the load. The wheel's own equation of motion gives the slip ratio. Signs are
# those of ISO 8855: braking gives a negative slip ratio and a negative ``Fx_rig``
# (:doc:`/reference/conventions`). ``frame_valid`` is passed on, so that a frame which the virtual
# tire could not make counts as lost; an estimate is used only while its own flag is true.

STEP = SAMPLES / RATE
SPEED, INERTIA, SHARE = 22.0, 1.2, 0.2


def state(time, kappa):
    return {
        "Fz": 4000 + 1000 * np.sin(2 * np.pi * 0.7 * time),
        "alpha": 0.0,
        "kappa": kappa,
        "camber": 0.0,
        "speed": SPEED,
        "pressure": PRESSURE,
    }


tire.set(**state(0.0, 0.0))
strain.set(speed=SPEED, pressure=PRESSURE, camber=0.0)
tire.slave.exitInitializationMode()
strain.slave.exitInitializationMode()

rows, statuses, kappa, torque = [], Counter(), 0.0, 0.0
for k in range(int(3.0 / STEP)):
    now = state(k * STEP, kappa)
    tire.set(**now)
    tire.slave.doStep(k * STEP, STEP)
    strain.set(**dict(zip(frame, tire.get(*frame), strict=True)), omega=tire.get("omega")[0])
    strain.set_flag("frame_valid", tire.get_flag("frame_valid"))
    strain.slave.doStep(k * STEP, STEP)
    load, std, slip = strain.get("Fz", "Fz_std", "kappa")
    fx, radius = tire.get("Fx_rig", "rolling_radius")
    if strain.get_flag("Fz_valid") and k * STEP > 0.8:
        torque = SHARE * load * radius  # the brake follows the estimate
    # spin of the wheel; the slope of the force is taken along, because the step is long
    stiffness = 20 * now["Fz"]
    rate = (-torque - radius * fx) / INERTIA * radius / SPEED
    kappa += STEP * rate / (1 + STEP * stiffness * radius**2 / (INERTIA * SPEED))
    rows.append((k * STEP, now["Fz"], load, std, fx, kappa, slip))
    statuses[strain.status() or "nothing to say"] += 1
tire.close()
strain.close()
time, true, estimated, std, fx, kappa, slip = np.array(rows).T

# %%
# What came out
# -------------
#
# Between two contacts nothing is measured: the estimate is a staircase with one step a turn, half a
# turn behind on average. That delay, and not the estimator, is most of the difference. The
# standard deviation holds what nobody told the estimator, here depth and temperature of the tread,
# and what the calibration did not vary: the status says ``condition_extrapolated``, because it was
# made at 65 km/h and the wheel rolls at 79.

braking = time > 1.2
share = -fx[braking] / true[braking]
late = estimated[braking] / true[braking] - 1
print(f"braking force over load: {share.mean():.3f} (asked: {SHARE}), std {share.std():.3f}")
print(f"estimated load held over the turn: {100 * np.sqrt(np.mean(late**2)):.1f} % rms")
print(f"standard deviation of the load: {np.median(std[braking]):.0f} N")
print("status:", ", ".join(f"{word} {n} steps" for word, n in statuses.most_common()))

fig, (upper, lower) = plt.subplots(2, 1, figsize=(7, 4.6), sharex=True)
upper.plot(time, true / 1e3, label="true")
upper.step(time, estimated / 1e3, where="post", label="estimated")
low, high = (estimated - 2 * std) / 1e3, (estimated + 2 * std) / 1e3
upper.fill_between(time, low, high, alpha=0.3, step="post")
upper.set(ylabel="Fz [kN]")
upper.legend()
lower.plot(time, 100 * kappa, label="true")
lower.step(time, 100 * slip, where="post", label="estimated")
lower.set(xlabel="time [s]", ylabel="slip ratio [%]")
fig.tight_layout()

# %%
# Four wheels and a whole vehicle: :doc:`/howto/cosim`. Another tool, as one archive:
# :doc:`/howto/ssp`. All inputs, outputs and refusals: :doc:`/howto/fmu`.
