"""
The bench, with your own transmitter
====================================

A wheel transmitter sends frames of strain; ``tirebench`` reads them, steps the estimator (the FMU),
shows and records. This page runs it twice without hardware: with the emulated transmitter of the
library, and with a transmitter of another make, which this script plays and a small *map*
describes.

You need tirelib with the extra ``bench`` (:doc:`/howto/install`), Linux or macOS, and
:download:`example_rig.py <../tutorials/example_rig.py>` in the folder of this script.
"""

# %%
# An estimator
# ------------
#
# As in :doc:`strain_to_load`: a day of measurements, a calibration, an FMU.

import json
import socket
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from time import sleep

import matplotlib.pyplot as plt
import numpy as np
from example_rig import measure

import tirelib

folder = Path(tempfile.mkdtemp())
conditions = [(load, a, 0.0) for load in (2000, 3000, 4000, 5000, 6000) for a in (-3, 0, 3)]
trained = tirelib.train(tirelib.observe([measure(folder / "day", conditions, seed=1)]))
tirelib.write_calibration(trained.calibration, folder / "cal.toml")
fmu = tirelib.build_fmu(folder / "cal.toml", folder / "StrainTire.fmu", samples_per_step=16)


def tirebench(*words):
    """Return a running program of the bench."""
    command = [sys.executable, "-m", "tirebench", *map(str, words)]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def valid_turns(file):
    """Return time [s], Fz [N] and its std of the valid turns in the JSON of a run."""
    turns = json.loads((folder / file).read_text())["turns"]
    return np.array([(t["t"], t["Fz"], t["Fz_std"]) for t in turns if t["Fz_valid"]]).T


# %%
# The emulated transmitter
# ------------------------
#
# ``emulate`` plays runs of a campaign as SERIAL v1 on a pseudo-terminal; ``run`` reads them as if
# it were a cable. In two terminals:
#
# .. code-block:: console
#
#    tirebench emulate --campaign laps --all --port-file port --conditions c.json
#    tirebench run --port-file port --wait --conditions c.json --fmu StrainTire.fmu \
#        --record live.mcap --json live.json --silence 5
#
# The second one shows a page in the browser (``--tui``: in the terminal); here it is switched off.
# ``tirebench --help`` has all commands from an empty folder on, with a campaign of the numerical
# rig in the place of ``laps``.

measure(folder / "laps", [(load, 0.0, 0.0) for load in (2500, 5000, 3500)], seed=4, turns=4)
sender = tirebench(
    "emulate", "--campaign", "laps", "--all", "--port-file", "port", "--conditions", "c.json"
)
reader = tirebench(
    "run", "--port-file", "port", "--wait", "--conditions", "c.json", "--fmu", fmu,
    "--record", "live.mcap", "--json", "live.json", "--silence", "5", "--every-turn", "--no-page",
)  # fmt: skip
print(reader.communicate()[0].decode())
sender.communicate()
_, load, std = valid_turns("live.json")

fig, ax = plt.subplots(figsize=(6.5, 3.2))
ax.errorbar(range(load.size), load / 1e3, yerr=1.96 * std / 1e3, fmt="o", capsize=3)
ax.set(xlabel="valid turn", ylabel="Fz, 95 % interval [kN]")
fig.tight_layout()

# %%
# The first turn of every run is not valid and not shown. ``live.mcap`` holds every byte that
# came; ``tirebench run --replay live.mcap --fmu StrainTire.fmu --json again.json`` gives the same
# numbers again.
#
# A transmitter of another make
# -----------------------------
#
# This one sends lines of text over TCP, one sample a line, with a counter and a checksum:
# ``$W;17;1203.5;1187.0;1241.5;1190.0;998.0*77``. The map says so:

(folder / "mine.toml").write_text(
    """
format      = "tirebench-map/1"
rate_hz     = 10000
strain_unit = "ustrain"

[[wheel]]
wheel   = 0
message = "WHEEL"
samples = [["g1", "g2", "g3", "g4", "g5"]]
counter = "count"

[[message]]
name      = "WHEEL"
starts    = "$W"
separator = ";"
columns   = [{ name = "count", bits = 16 }, "g1", "g2", "g3", "g4", "g5"]
checksum  = "XOR-8"
""",
    encoding="utf-8",
)

# %%
# With frames on CAN, a DBC and the names of its signals stand in the place of ``[[message]]``
# (:doc:`/reference/protocols`).
#
# The transmitter itself is a TCP server that sends 20 ms of samples at a time:

campaign = measure(folder / "mine", [(4200, 0.0, 0.0)], seed=5, turns=6)
strain = 1e6 * campaign.load(campaign.plans[0]).strain
server = socket.create_server(("127.0.0.1", 0))


def line(count, sample):
    """Return one line with its checksum."""
    body = ";".join(["W", str(count % 65536), *(f"{value:.2f}" for value in sample)])
    checksum = 0
    for letter in body.encode():
        checksum ^= letter
    return f"${body}*{checksum:02X}\r\n"


def transmit():
    """Wait for the reader, and send everything at the pace of the gages."""
    lines = [line(count, sample) for count, sample in enumerate(strain.T)]
    connection, _ = server.accept()
    with connection:
        for first in range(0, len(lines), 200):
            connection.sendall("".join(lines[first : first + 200]).encode())
            sleep(0.02)


thread = threading.Thread(target=transmit)
thread.start()
reader = tirebench(
    "run", "--port", f"tcp://127.0.0.1:{server.getsockname()[1]}", "--map", "mine.toml",
    "--fmu", fmu, "--speed", "65", "--pressure", "2.3", "--camber", "0",
    "--condition", "friction=0.9",
    "--condition", "tread_depth=8", "--json", "mine.json", "--reconnect", "0", "--every-turn",
    "--no-page",
)  # fmt: skip
print(reader.communicate()[0].decode())
thread.join()
server.close()
_, mine, mine_std = valid_turns("mine.json")
print(
    f"own transmitter: {mine.size} valid turns, Fz = {mine.mean():.0f} +- {mine_std.mean():.0f} N"
)

# %%
# Where to go on
# --------------
#
# - Everything the bench does: :doc:`/howto/bench`; the page: :doc:`/howto/live_page`.
# - The bytes of SERIAL v1 and of CAN frames, and every key of a map: :doc:`/reference/protocols`.
