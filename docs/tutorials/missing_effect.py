"""
Find the missing effect
=======================

A model of a tire is fitted to measurements. It does not fit everywhere. *Which physical effect is
missing?* This page answers that for side force, three times: in Python, in the shell, and in the
studio. The same verbs work on strain; see the end.

The measurements are made up on the spot, so that the answer is known: the friction of this tire
falls with the load, which the base model does not have.
"""

# %%
# Measurements with something hidden
# ----------------------------------
#
# Three loads, ten slip angles, each run twice. The force is that of a brush model whose friction
# coefficient falls with load by a power of 0.25, with a noise of 6 N. Measurements of your own come
# in by :doc:`own_measurements`.

import subprocess
import sys
import tempfile
from pathlib import Path
from textwrap import fill

import matplotlib.pyplot as plt
import numpy as np

import tirelib
from tirelib.campaign import CampaignHeader, Run, RunPlan, TireGeometry, Tolerance, write_campaign
from tirelib.physics.brush.predict import PointConditions, PointParameters, predict_forces

folder = Path(tempfile.mkdtemp())
random = np.random.default_rng(7)
plan = [
    (load, angle)
    for load in (2000.0, 4000.0, 6000.0)
    for angle in np.deg2rad([-7, -5, -3, -1.5, -0.5, 0.5, 1.5, 3, 5, 7])
    for _ in range(2)
]


def measured(number, load, angle):
    """Return one run: eight values of every channel."""
    friction = 0.95 * (load / 4000) ** -0.25  # this is what the base model lacks
    tire = PointParameters(9e6, friction, 0.06 * (load / 4000) ** 0.45)
    force = predict_forces(tire, PointConditions(load, angle)).Fy.item()
    channels = {
        "Fz": load,
        "pressure": 2.1e5,
        "slip_angle": angle,
        "camber": 0.0,
        "speed": 18.0,
        "Fy": force + 6 * random.standard_normal(),
    }
    return Run(
        RunPlan(number, "", "corner", load, 2.1e5, 18.0, angle, 0.0, 0.0, start=12.0 * number),
        rig={name: np.full(8, value) for name, value in channels.items()},
        rig_time=np.arange(8) / 100,
    )


header = CampaignHeader(
    name="side force",
    axes="iso",
    tire=TireGeometry("made-up tire", 0.3155, 0.302, 0.012, 0.165, -0.0033),
    tolerance=Tolerance(load=0.005, pressure=0.002, speed=0.001, gain=0.003),
)
write_campaign(folder / "cornering", header, (measured(n, *at) for n, at in enumerate(plan)))
campaign = tirelib.read_campaign(folder / "cornering")

# %%
# In Python
# ---------
#
# Fit the base model, and look where it fails. The error is in units of the noise between repeated
# runs: 1 would be a model that is as good as the measurement.

model = tirelib.identify(campaign).file
before = tirelib.compare(campaign, model, "Fy")
print(f"error of the base model: {before.error:.1f} times the noise")

# %%
# Ask what is missing. The verdict names effects of the catalogue (:doc:`/howto/effects`), or says
# that none of them explains the data.

found = tirelib.diagnose(campaign, model, quantity="Fy")
print("named:", ", ".join(found.named) or "nothing")
candidates = tirelib.candidate_table(found)
print(candidates[["level", "score", "threshold", "strength", "std"]].head(4).to_string())

# %%
# Add what was named, and watch the error fall.

errors = [before.error]
for name in found.named:
    model, step = tirelib.add(name, model, campaign)
    errors.append(step["error_after"])
    print(f"with {name}: {step['error_before']:.1f} -> {step['error_after']:.2f} times the noise")
tirelib.write_tire(model, folder / "M2.toml", "tirelib-model/1")

fig, ax = plt.subplots(figsize=(6, 3))
ax.bar(["base model", *found.named], errors)
ax.axhline(1, color="0.4", ls=":")
ax.set(ylabel="error [noise of repeated runs]")
fig.tight_layout()

# %%
# In the shell
# ------------
#
# The same steps; each verb writes the same numbers with ``--json`` and a page with ``--out``:
#
# .. code-block:: console
#
#    tirelib identify cornering --out M.toml
#    tirelib compare  cornering --model M.toml --quantity Fy --out where-it-fails
#    tirelib diagnose cornering --model M.toml --quantity Fy --out what-is-missing
#    tirelib add friction_load --model M.toml --data cornering --out M2.toml
#
# or all of it at once, which the script does here:

explain = "tirelib explain cornering --quantity Fy --out explained"
done = subprocess.run(
    [sys.executable, "-m", *explain.split()],
    cwd=folder,
    capture_output=True,
    text=True,
    check=True,
)
for line in [f"$ {explain}", *done.stdout.splitlines()[:8]]:
    print(fill(line, 88, subsequent_indent="    "))

# %%
# In the studio
# -------------
#
# .. code-block:: console
#
#    tirelib studio cornering
#
# opens a page in the browser. *See* shows the residual over slip and load; *Find what is missing*
# runs the diagnosis; tick ``friction_load`` and *Add*. The five steps with pictures are in
# :doc:`/howto/studio`; here the third one, on a campaign of strain. What the page shows are the
# documents of the commands above.
#
# .. image:: /howto/studio/suspect.png
#    :alt: The studio: effects, verdict, and what the suspected effect would leave
#
# On strain
# ---------
#
# With gages, the same question is asked of whole strain waveforms, and the answers are about belt,
# sidewall, tread and gages. It takes some minutes, most of it for a virtual tire to be measured:
#
# .. code-block:: console
#
#    tirelib rig --plan short --hide sidewall_damping=0.05 --out straight
#    tirelib identify straight --out M.toml
#    tirelib diagnose straight --model M.toml --out what-is-missing
#    tirelib add sidewall_damping --model M.toml --data straight --out M2.toml
#
# How a verdict is reached is on :doc:`/howto/diagnose`, with equations on :doc:`/theory/inference`,
# and how often it is right on :doc:`/theory/verdicts_measured`.
