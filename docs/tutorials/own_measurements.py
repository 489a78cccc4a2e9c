"""
Your own measurements
=====================

Your rig writes CSV or MAT files, with its own names, units and axis system. This page takes such
files to the end: ``import``, ``check``, ``identify``, ``diagnose``, ``add``. First a table of
forces with something hidden in it, then strain. The mistakes that people make stand in between,
each with what the library says to it.

You need tirelib (:doc:`/howto/install`), and :download:`example_rig.py
<../tutorials/example_rig.py>` in the folder of this script for the part with strain.
"""

# %%
# What the laboratory hands over
# ------------------------------
#
# Three CSV files, one for each load, with a slip angle that goes up and down between -7 and 7 deg.
# The files are in SAE axes, as a German spreadsheet writes them: semicolons, decimal commas, a
# line of units. They are made up here, so that the answer is known: the friction of this tire falls
# with the load.

import os
import shlex
import subprocess
import sys
import tempfile
import tomllib
from itertools import chain
from pathlib import Path
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np
from example_rig import measure
from scipy.io import savemat

import tirelib
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces

folder = Path(tempfile.mkdtemp())
random = np.random.default_rng(7)
time = np.arange(0, 36, 0.08)
slip = 7 * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * time / 12))  # deg, ISO
for load in (2000, 4000, 6000):
    friction = 0.95 * (load / 4000) ** -0.25  # this is hidden
    tire = PointParameters(9e6, friction, 0.06 * (load / 4000) ** 0.45)
    force = [predict_forces(tire, PointConditions(load, a)).Fy.item() for a in np.deg2rad(slip)]
    noisy = np.array(force) + 15 * random.standard_normal(time.size)
    rows = ["Zeit;Last;Seitenkraft;Schraeglauf;Druck;Geschwindigkeit", "s;N;N;deg;kPa;km/h"]
    for t, fy, angle in zip(time, -noisy, -slip, strict=True):  # SAE turns the signs
        values = (t, -load, fy, angle, 230.0, 65.0)
        rows.append(";".join(f"{value:.4f}".replace(".", ",") for value in values))
    (folder / f"load{load}.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")

# %%
# Type the commands of this page in the folder of the files. The script does it in your place:


def shell(line, lines=99):
    """Run a command, and print the first lines of its answer."""
    words = [sorted(path.name for path in folder.glob(w)) or [w] for w in shlex.split(line)]
    done = subprocess.run(
        [sys.executable, "-m", *chain(*words)],
        cwd=folder,
        env={**os.environ, "COLUMNS": "88"},
        capture_output=True,
        text=True,
        check=False,
    )
    answer = done.stdout if done.returncode < 2 else done.stderr[done.stderr.find("Error") :]
    for said in [f"$ {line}", *answer.rstrip().splitlines()[:lines]]:
        print(fill(said, 88, subsequent_indent="    "))


shell("tirelib import load2000.csv --list")

# %%
# The map
# -------
#
# A *map* says which column is which quantity. ``--suggest`` drafts it from the names that it knows:

shell("tirelib import load2000.csv --suggest")

# %%
# What the file does not say is left to you: the axes, the radius, and the column of the load, whose
# name it does not know. ``kind = "sweep"`` means that the slip angle moves within a run.

MAP = """
format = "tirelib-map/1"
axes   = "sae"
kind   = "sweep"
name   = "cornering"

[tire]
free_radius_m = 0.3155

[channels]
time       = { column = "Zeit" }
Fz         = { column = "Last" }
Fy         = { column = "Seitenkraft" }
slip_angle = { column = "Schraeglauf" }
pressure   = { column = "Druck" }
speed      = { column = "Geschwindigkeit" }
"""
(folder / "lab.map.toml").write_text(MAP, encoding="utf-8")
shell("tirelib import load*.csv --map lab.map.toml --out cornering")
shell("tirelib campaign check cornering")

# %%
# Look at what was read, before you believe anything. From here on all is in ISO 8855 and SI: the
# load is positive, and a positive slip angle gives a negative side force
# (:doc:`/reference/conventions` has the drawings).

fig, ax = plt.subplots(figsize=(6, 3.2))
for run in tirelib.read_campaign(folder / "cornering").runs():
    ax.plot(np.rad2deg(run.rig["slip_angle"]), run.rig["Fy"] / 1000, lw=0.7)
ax.set(xlabel="slip angle [deg], ISO 8855", ylabel="Fy [kN], ISO 8855")
fig.tight_layout()

# %%
# Mistakes in the map
# -------------------
#
# An import with faults lists all of them, for every file, and writes nothing.


def mistake(right, wrong, file="load2000.csv"):
    """Import with one mistake in the map."""
    (folder / "wrong.toml").write_text(MAP.replace(right, wrong), encoding="utf-8")
    shell(f"tirelib import {file} --map wrong.toml --out wrong")


# %%
# **The wrong axis system.** The files are in SAE axes, the map says ISO:

mistake('"sae"', '"iso"')

# %%
# **One column turned.** The rig's slip angle has the other sign:

mistake('"Schraeglauf" }', '"Schraeglauf", sign = -1 }')

# %%
# **A unit that contradicts the file.** The file says kPa:

mistake('"Druck" }', '"Druck", unit = "bar" }')

# %%
# **A column that is not there:**

mistake('"Last"', '"Radlast"')

# %%
# **A sweep that is called a steady run.** Steady runs have set points:

mistake('kind   = "sweep"', 'kind   = "corner"')

# %%
# What is missing
# ---------------
#
# Fit a model. For a table of forces it is a brush; strain gives a rolling ring as well. The output
# ends with the file and the next step:

shell("tirelib identify cornering --out M.toml")

# %%
# Then ask what it lacks. The first lines are the verdict; ``--out`` writes a page with plots:

shell("tirelib diagnose cornering --model M.toml --quantity Fy --out what-is-missing", lines=5)

# %%
# The friction falls with the load; with it the model is as good as the noise. Add what was named:
# the model is fitted again, and judged on parts that are left out of the fit.

shell("tirelib add friction_load --model M.toml --data cornering --quantity Fy --out M2.toml")

(effect,) = tomllib.loads((folder / "M2.toml").read_text(encoding="utf-8"))["effects"]
strength = effect["strength"]
print(f"friction_load: {strength:.3f} (hidden: 0.25)")

# %%
# Diagnose again, with the new model, until nothing is missing:

shell("tirelib diagnose cornering --model M2.toml --quantity Fy", lines=2)

# %%
# **One load only.** The same question, asked of one file, cannot be answered, and ``none`` alone
# would mislead. Read the sentence that says what a plan *cannot show*:

shell("tirelib import load4000.csv --map lab.map.toml --out one-load")
shell("tirelib identify one-load --out one-load.toml", lines=1)
shell("tirelib diagnose one-load --model one-load.toml --quantity Fy", lines=3)

# %%
# Strain in MAT files
# -------------------
#
# Two clocks in one file are usual: gages at 10 kHz, forces at 100 Hz. Each file becomes one run;
# the set points come from the map, here the load from the mean of the run.

original = measure(
    folder / "laboratory", [(load, 0.0, 0.0) for load in (2500, 4500, 6500)], seed=3, turns=4
)
for run in original.runs():
    savemat(
        folder / f"run{run.plan.run}.mat",
        {
            "t_fast": np.arange(run.strain.shape[1]) / run.rate,
            "strain": 1e6 * run.strain.T,
            "t": run.rig_time,
            "FZ": run.rig["Fz"],
            "V": 3.6 * run.rig["speed"],
            "P": run.rig["pressure"] / 1e5,
            "OMEGA": run.rig["omega"],
        },
    )
gages = "\n".join(
    f'strain_{n + 1} = {{ column = "strain(:,{n + 1})", unit = "ustrain" }}' for n in range(5)
)
STRAIN_MAP = f"""
format = "tirelib-map/1"
axes   = "iso"
kind   = "free"

[tire]
free_radius_m = 0.3155
ring_radius_m = 0.302
tread_thickness_m = 0.012
belt_width_m = 0.165
innerliner_offset_m = -0.0033

[gages]
lateral_m = {list(original.header.gage_lateral)}

[set_points]
load_N = {{ mean_to = 100 }}
pressure_bar = 2.3
speed_kmh = 65.0
slip_angle_deg = 0.0
camber_deg = 0.0
slip_ratio = 0.0

[channels]
time       = {{ column = "t", unit = "s" }}
gage_time  = {{ column = "t_fast", unit = "s" }}
{gages}
Fz         = {{ column = "FZ", unit = "N" }}
speed      = {{ column = "V", unit = "km/h" }}
pressure   = {{ column = "P", unit = "bar" }}
omega      = {{ column = "OMEGA", unit = "rad/s" }}
"""
(folder / "strain.map.toml").write_text(STRAIN_MAP, encoding="utf-8")
shell("tirelib import run*.mat --map strain.map.toml --out strain")
shell("tirelib campaign check strain")

# %%
# The imported campaign gives the same turns as the laboratory's own:

mine = tirelib.observe([tirelib.read_campaign(folder / "strain")])
theirs = tirelib.observe([original])
difference = float(np.nanmax(np.abs(mine.features.contact_angle - theirs.features.contact_angle)))
print(f"{len(mine)} turns; contact angles differ by at most {difference:.1e} rad")

# %%
# From here on the strain goes its own way: :doc:`strain_to_load` calibrates on it, and the question
# what is missing is asked with the same verbs. Fifteen CSV files with strain, exported from a
# virtual tire whose sidewall damping was raised (``tirelib rig --plan short --hide
# sidewall_damping=0.05``), took a minute of one core from the files to the added effect; the map
# for them is in :doc:`/howto/importing`:
#
# .. code-block:: console
#
#    tirelib import lab/run*.csv --map lab.map.toml --out day1
#    tirelib campaign check day1
#    tirelib identify day1 --out M.toml
#    tirelib diagnose day1 --model M.toml --out what-is-missing
#    tirelib add sidewall_damping --model M.toml --data day1 --out M2.toml
#
# .. code-block:: text
#
#    day 1, strain: named: sidewall_damping; error 93.4 -> 12.7 [noise], floor 12.7
#
# Mistakes with strain
# --------------------
#
# **Gages in the wrong order.** ``lateral_m`` names the gages from the first to the last; y is
# positive to the left in ISO and to the right in SAE axes. A list that does not fit the strain is
# found as soon as runs with slip angles to both sides are there; until then the check says that the
# order was not checked. **No repeats.** Without repeated runs the noise is unknown, and a diagnosis
# gives hints only. **Strain in volts** needs a ``factor``. **Missing values, repeated times,
# jumps** are refused with their rows until the map says how to treat them: see
# :doc:`/howto/importing`.
