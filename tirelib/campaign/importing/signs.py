"""Signs against the declared axes, as `tirelib campaign check` judges them."""

from collections.abc import Mapping

import numpy as np

from tirelib.campaign.check_order import force_sign_of
from tirelib.campaign.check_rig import shown
from tirelib.campaign.finding import RunFinding
from tirelib.campaign.importing.mapfile import ImportMap
from tirelib.campaign.model import FloatArray, Run, RunPlan
from tirelib.campaign.problem import Problem

_PLAN = RunPlan(0, "", "sweep", *(float("nan"),) * 6)


def sign_findings(source: str, rig: Mapping[str, FloatArray], rules: ImportMap) -> list[RunFinding]:
    """Return the signs of one run that contradict the axes of the map.

    Parameters
    ----------
    source : str
        File, and run where it holds several.
    rig : mapping of quantity to array, shape (n_rig,)
        SI and ISO, if the map is right.
    rules : ImportMap
    """
    found: list[RunFinding] = []
    axes = rules.header.axes
    load = rig.get("Fz")
    if load is not None and load.size and float(np.median(load)) < 0.0:
        given = "positive" if axes == "sae" else "negative"
        right = "negative" if axes == "sae" else "positive"
        extent = "throughout" if float(load.max()) < 0.0 else "in the middle"
        found.append(
            _contradiction(
                source,
                "Fz",
                f"wrong sign: {given} {extent} (median "
                f"{shown('Fz', float(np.median(load)), axes)}), axes = {axes!r}",
                f"Fz of a loaded tire is {right} in these axes",
                rules,
            )
        )
    share = force_sign_of(Run(_PLAN, rig=rig)).share if _finite(rig) else None
    if share is not None and share > 0.5:
        same = "the same sign" if axes == "adapted_sae" else "opposite signs"
        found.append(
            _contradiction(
                source,
                "Fy",
                f"wrong sign: Fy against slip angle contradicts axes = {axes!r} in "
                f"{100.0 * share:.0f} % of the samples with a clear slip angle",
                f"Fy and slip angle have {same} in these axes",
                rules,
            )
        )
    return found


def _finite(rig: Mapping[str, FloatArray]) -> bool:
    names = ("Fy", "slip_angle", "Fz", "camber")
    return all(np.isfinite(rig[name]).all() for name in names if name in rig)


def _contradiction(
    source: str, quantity: str, given: str, allowed: str, rules: ImportMap
) -> RunFinding:
    column = rules.channels[quantity].column
    place = f"column {column!r} ({quantity})"
    remedy = f"correct axes in {rules.file}, or write sign = -1 for the column that is turned"
    problem = Problem(f"{source}, {place}", given, allowed, remedy)
    return RunFinding(f"sign {quantity}", source, place, problem)
