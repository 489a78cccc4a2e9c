"""
Your own measurements
=====================

Your rig writes CSV or MAT files, with its own names, units and axis system. ``tirelib import``
makes a campaign of them with a small *map*. This page does it for a table of forces and for MAT
files with strain, and shows the mistakes that people make, with what the library says to each.

You need tirelib (:doc:`/howto/install`), and :download:`example_rig.py
<../tutorials/example_rig.py>` in the folder of this script; it plays your laboratory.
"""

# %%
# A table of forces
# -----------------
#
# A slip angle sweep in SAE axes as a German spreadsheet writes it: semicolons, decimal commas, a
# line of units.

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from example_rig import measure
from scipy.io import savemat

import tirelib
from tirelib.errors import TirelibError

folder = Path(tempfile.mkdtemp())
time = np.arange(0, 20, 0.02)
slip = 6 * np.sin(2 * np.pi * time / 10)  # deg
load = 4000 + 30 * np.sin(7 * time)
side = -0.9 * load * np.tanh(slip / 4)  # ISO: a positive slip angle gives a negative Fy
rows = ["Zeit;Last;Seitenkraft;Schraeglauf;Druck", "s;N;N;deg;kPa"]
for values in zip(time, -load, -side, -slip, np.full(time.size, 230.0), strict=True):
    rows.append(";".join(f"{value:.4f}".replace(".", ",") for value in values))
(folder / "sweep.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")

# %%
# The map says which column is which quantity. ``tirelib import sweep.csv --list`` shows the
# columns, ``--suggest`` drafts a map for names that it knows.

MAP = """
format = "tirelib-map/1"
axes   = "sae"
kind   = "sweep"

[tire]
free_radius_m = 0.3155

[channels]
time       = { column = "Zeit" }
Fz         = { column = "Last" }
Fy         = { column = "Seitenkraft" }
slip_angle = { column = "Schraeglauf" }
pressure   = { column = "Druck" }
"""


def make(text, files, name):
    """Import, and print what the library says."""
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    try:
        tirelib.import_campaign(files, folder / f"{name}.toml", folder / name, overwrite=True)
    except TirelibError as error:
        print(str(error).replace(str(folder), "."))
        return
    for finding in tirelib.check_campaign(folder / name):
        print(str(finding).replace(str(folder), "."))
    print(f"{name} is written")


make(MAP, [folder / "sweep.csv"], "sweep")
(run,) = tirelib.read_campaign(folder / "sweep").runs()

fig, ax = plt.subplots(figsize=(6, 3.2))
ax.plot(np.rad2deg(run.rig["slip_angle"]), run.rig["Fy"], lw=1)
ax.set(xlabel="slip angle [deg], ISO 8855", ylabel="Fy [N], ISO 8855")
fig.tight_layout()

# %%
# Everything is in ISO 8855 and SI from here on: the load is positive, and a positive slip angle
# gives a negative side force (:doc:`/reference/conventions` has the drawings).
#
# Mistakes
# --------
#
# **The wrong axis system.** The file is in SAE axes, the map says ISO. The load would be negative:

make(MAP.replace('"sae"', '"iso"'), [folder / "sweep.csv"], "wrong_axes")

# %%
# **A unit that contradicts the file.** The file says kPa:

make(MAP.replace('"Druck" }', '"Druck", unit = "bar" }'), [folder / "sweep.csv"], "wrong_unit")

# %%
# **A column that is not there**, and a radius that is missing. All faults are listed at once, and
# nothing is written:

make(
    MAP.replace('"Last"', '"Load"').replace("free_radius_m = 0.3155", ""),
    [folder / "sweep.csv"],
    "wrong_names",
)

# %%
# Strain in MAT files
# -------------------
#
# Two clocks in one file are usual: gages at 10 kHz, forces at 100 Hz. Each file becomes one run;
# the set points come from the map, here the load from the mean of the run.

original = measure(
    folder / "laboratory", [(load, 0.0, 0.0) for load in (2500, 4500, 6500)], seed=3, turns=4
)
files = []
for run in original.runs():
    files.append(folder / f"run{run.plan.run}.mat")
    savemat(
        files[-1],
        {
            "t_fast": np.arange(run.strain.shape[1]) / run.rate,
            "strain": 1e6 * run.strain.T,
            "t": run.rig_time,
            "FZ": run.rig["Fz"],
            "FY": run.rig["Fy"],
            "V": 3.6 * run.rig["speed"],
            "P": run.rig["pressure"] / 1e5,
            "ALPHA": np.rad2deg(run.rig["slip_angle"]),
            "CAMBER": np.rad2deg(run.rig["camber"]),
            "KAPPA": run.rig["slip_ratio"],
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
Fy         = {{ column = "FY", unit = "N" }}
speed      = {{ column = "V", unit = "km/h" }}
pressure   = {{ column = "P", unit = "bar" }}
slip_angle = {{ column = "ALPHA", unit = "deg" }}
camber     = {{ column = "CAMBER", unit = "deg" }}
slip_ratio = {{ column = "KAPPA", unit = "1" }}
omega      = {{ column = "OMEGA", unit = "rad/s" }}
"""
make(STRAIN_MAP, files, "strain")

# %%
# The imported campaign gives the same turns as the laboratory's own:

mine = tirelib.observe([tirelib.read_campaign(folder / "strain")])
theirs = tirelib.observe([original])
difference = float(np.nanmax(np.abs(mine.features.contact_angle - theirs.features.contact_angle)))
print(f"{len(mine)} turns; contact angles differ by at most {difference:.1e} rad")

# %%
# **Gages in the wrong order.** ``lateral_m`` names the gages from the first to the last; y is
# positive to the left in ISO and to the right in SAE axes. A list that does not fit the strain is
# found as soon as runs with a slip angle are there. **Strain in volts** needs a ``factor``.
# **Missing values, repeated times, jumps** are refused with their rows until the map says how to
# treat them: see :doc:`/howto/importing`.
