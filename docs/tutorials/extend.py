"""
Write an effect, an estimator, a link
=====================================

Three places where people extend the library: a physical effect that a diagnosis should know, an
estimator of their own next to the library's, and a link to a line that the bench does not know yet.

You need tirelib with the extra ``bench`` (:doc:`/howto/install`), and :download:`example_rig.py
<../tutorials/example_rig.py>` in the folder of this script.
"""

# %%
# An effect
# ---------
#
# An effect is a law of a few lines: it takes the state of the model and a strength, and returns the
# changed state. Strength zero must be the base model. What ``state`` holds at each stage is in
# :doc:`/howto/effects`.

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from example_rig import measure

import tirelib
from tirebench.deadline import Deadline
from tirebench.links import Read
from tirebench.protocols import LINE_MAP
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.user_map import parse_map
from tirebench.wire.frames import Frames
from tirelib.effects import CATALOGUE, effect
from tirelib.model.registration import register


@effect(
    "wet_road",
    stage="brush",
    unit="1",
    low=0.0,
    high=0.9,
    varies_with=("speed",),
    needs=("speed",),
    source="my own guess",
)
def wet_road(state, strength):
    """Friction falls with the square of the speed on a wet road."""
    share = (state.conditions.speed / 30.0) ** 2
    return state.but(mu=state.mu * (1.0 - strength * share / (1.0 + share)))


# %%
# Before it takes part it is tested: it is planted and has to be found again. In the shell:
# ``tirelib effects --effects mine.py``, and then ``tirelib diagnose ... --effects mine.py``.

report = register(wet_road, {**CATALOGUE, "wet_road": wet_road})
print("faults:", report.faults or "none")
print(f"planted {report.planted:.3f}, found {report.recovered:.3f}")
print(f"the base model imitates {100 * (1 - report.survives):.0f} % of it")
print("looks like:", ", ".join(name for name, _ in report.twins) or "nothing else")

# %%
# To put it into the catalogue, make it a file in ``tirelib/effects`` and add a line to
# ``CATALOGUE``; `CONTRIBUTING.md` has the steps.
#
# An estimator
# ------------
#
# ``observe`` gives the features of every turn as arrays. What you make of them is yours: here the
# load as a straight line over the contact angle of the centre gage and the depth of the
# compression, by least squares.

folder = Path(tempfile.mkdtemp())
loads = (1500, 2500, 3500, 4500, 5500, 6500)
first = tirelib.observe([measure(folder / "day1", [(f, 0.0, 0.0) for f in loads], seed=1)])
second = tirelib.observe(
    [measure(folder / "day2", [(f, 0.0, 0.0) for f in (2000, 4000, 6000)], seed=2)]
)


def regressors(observed):
    """Return what the load is explained by, shape (n, 3)."""
    features, centre = observed.features, observed.features.centre_gage
    return np.stack(
        [
            np.ones(len(observed)),
            features.contact_angle[:, centre],
            features.cp1[:, centre],
        ],
        axis=1,
    )


use = first.usable
coefficients, *_ = np.linalg.lstsq(regressors(first)[use], first.truth["Fz"][use], rcond=None)
use = second.usable
error = regressors(second)[use] @ coefficients - second.truth["Fz"][use]
print(f"own estimator: {np.sqrt(np.mean(error**2)):.0f} N rms on another day")

fig, ax = plt.subplots(figsize=(5, 3))
ax.plot(second.truth["Fz"][use] / 1e3, error, "o")
ax.set(xlabel="Fz [kN]", ylabel="error of the own estimator [N]")
fig.tight_layout()

# %%
# A turn that is not ``usable`` has a flag that forbids any estimate. The library's own estimators,
# with intervals and ranges, are in ``tirelib.estimators``; :doc:`/theory/estimators` says what each
# of them adds to a line like the one above.
#
# A link
# ------
#
# A link gives the bench bytes as they come: ``receive`` waits until a deadline, and returns
# ``None`` when nothing will come any more. This one reads a log file in pieces.
# (``tirebench.links.Link`` is the protocol that a type checker compares it with;
# ``tirebench.links.opening`` is where a new kind of port gets its name.)


class LogLink:
    """Bytes from a file that another program has logged."""

    live = False
    encoding = LINE_MAP

    def __init__(self, path, size=4096):
        self.name = str(path)
        self._data, self._size = Path(path).read_bytes(), size

    def receive(self, deadline: Deadline) -> Read | None:
        """Return the next piece."""
        piece, self._data = self._data[: self._size], self._data[self._size :]
        return Read(0, piece) if piece else None

    def close(self):
        """Give nothing back: the file was read at once."""

    def overruns(self):
        """Return 0: a file loses nothing."""
        return 0


MAP = """
format      = "tirebench-map/1"
rate_hz     = 1000
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
"""
(folder / "log.txt").write_text(
    "".join(f"$W;{n};{n}.5;0;-{n};1.25;3\r\n" for n in range(1000)), encoding="ascii"
)
decoder = ProtocolPlan(LINE_MAP, 1e3, parse_map(MAP, "", "map.toml")).decoder()
link, samples = LogLink(folder / "log.txt"), 0
while (read := link.receive(Deadline.never())) is not None:
    samples += sum(len(item) for item in decoder.push(read.data) if isinstance(item, Frames))
link.close()
print(f"{samples} samples came through the link")
