"""
From strain to load in ten minutes
==================================

Five gages on the innerliner are measured on a rig together with the forces. From one such day you
get a **calibration**; with it, every turn of any other measurement becomes a vertical load, a slip
angle, a slip ratio and a lateral force, each with an interval. This page does it once from end to
end.

You need tirelib (:doc:`/howto/install`), this script, and :download:`example_rig.py
<../tutorials/example_rig.py>` in the same folder; the archives below hold both. The script takes
some seconds.
"""

# %%
# Two days of measurements
# ------------------------
#
# A *campaign* is a folder of measurements (:doc:`/reference/campaign`). With measurements of your
# own you would begin with :doc:`own_measurements`. Here a virtual tire is measured: on the first
# day, seven loads and five slip angles; on the second, loads and angles that the first day has not
# seen.

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from example_rig import measure

import tirelib

folder = Path(tempfile.mkdtemp())
loads = range(1500, 7501, 1000)
day1 = measure(
    folder / "day1",
    [(load, angle, 0.0) for load in loads for angle in (-4, -2, 0, 2, 4)],
    seed=1,
)
day2 = measure(
    folder / "day2",
    [(load, angle, 0.0) for load in (2200, 3700, 5200, 6700) for angle in (-3.2, -0.5, 1.8)],
    seed=2,
)
findings = tirelib.check_campaign(folder / "day1")
print(f"day 1: {len(day1.plans)} runs")
for finding in findings:
    print(finding)

# %%
# In the shell the same check is ``tirelib campaign check day1``; it lists every fault of a folder
# at once and says what to do about each.
#
# What the gages see
# ------------------
#
# In the contact the belt is flattened and the innerliner is stretched; just outside it is
# compressed. A higher load makes the contact longer: that is what the estimate of the load lives
# on.

fig, ax = plt.subplots(figsize=(7, 3.2))
for number in (2, 17, 32):  # three loads, straight ahead
    run = day1.load(day1.plans[number])
    centre = run.strain[2] * 1e6
    time = np.arange(centre.size) / run.rate
    ax.plot(time * 1e3, centre, label=f"{run.plan.load:.0f} N")
ax.set(xlabel="time [ms]", ylabel="strain of the centre gage [microstrain]", xlim=(0, 250))
ax.legend(title="Fz", loc="center right")
fig.tight_layout()

# %%
# Calibrate
# ---------
#
# ``observe`` cuts the signal into turns and measures edges, peaks and slopes of each contact;
# ``train`` fits the estimators and judges each of them on levels that it left out.
# The shell has both in one verb: ``tirelib calibrate day1 --out cal.toml``.

trained = tirelib.train(tirelib.observe([day1]))
tirelib.write_calibration(trained.calibration, folder / "cal.toml")

# %%
# Estimate another day
# --------------------
#
# ``tirelib estimate day2 --calibration cal.toml --json estimates.json`` in the shell. The load that
# the rig measured is used for the comparison only.

observed = tirelib.observe([day2])
estimates = trained.calibration.estimate(observed.features)
valid = estimates.turn_valid
true_load = observed.truth["Fz"]  # mean of each run
error = (estimates.value["Fz"] - true_load)[valid]
rmse = float(np.sqrt(np.mean(error**2)))
held = float(np.mean(np.abs(error) < 1.96 * estimates.std["Fz"][valid]))
print(f"{valid.sum()} of {valid.size} turns are valid")
print(f"error of Fz: {rmse:.1f} N rms; {100 * held:.0f} % of the turns lie in their 95 % interval")

# %%
# The same as a pandas table, a row for each turn, beside what the rig measured (SI units):

table = tirelib.estimate_table(observed, estimates)
print(table[["run", "time", "Fz", "Fz_std", "Fz_measured", "flags"]].head(4).to_string())

# %%
# The first turn of each run is not valid: nothing is known of the turn before it. Every other
# reason is a flag of its own (:doc:`/reference/flags`).
#
# Try four loads instead of seven: the error is ten times as large, and the interval is wider, but
# no load can be left out to say by how much (:doc:`/theory/estimators`, "Standard deviations").
# Measure more levels than you think you need, and read the error of a load left out in the report.

fig, ax = plt.subplots(figsize=(7, 3.6))
ax.errorbar(
    true_load[valid] / 1e3,
    error,
    yerr=1.96 * estimates.std["Fz"][valid],
    fmt=".",
    capsize=2,
)
ax.axhline(0, color="0.6", lw=1)
ax.set(xlabel="Fz measured [kN]", ylabel="Fz estimated less measured,\n95 % interval [N]")
fig.tight_layout()

# %%
# Where to go on
# --------------
#
# - Your own files: :doc:`own_measurements`.
# - Which quantities and which laws: :doc:`/theory/estimators`; where they stop:
#   :doc:`/reference/validity`.
# - The same estimates live in a vehicle model: :doc:`vehicle_loop`; on a test bench:
#   :doc:`bench_transmitter`.
# - What these figures are worth on a real tire: :doc:`/theory/limits`.
