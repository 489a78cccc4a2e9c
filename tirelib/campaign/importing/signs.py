"""Signs against the declared axes, as `tirelib campaign check` judges them."""

from collections.abc import Mapping

import numpy as np

from tirelib.campaign.campaign_fault import CampaignFault
from tirelib.campaign.check_order import FOLLOWS, force_sign_of, moment_sign_of, signs_of
from tirelib.campaign.check_rig import shown
from tirelib.campaign.finding import RunFinding
from tirelib.campaign.importing.rules import ImportMap
from tirelib.campaign.model import FloatArray, Run, RunPlan

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
    if not _finite(rig):
        return found
    run = Run(_PLAN, rig=rig)
    for told, angles in (
        (force_sign_of(run), "a clear slip angle"),
        (moment_sign_of(run), "a small slip angle"),
    ):
        if told.share is not None and told.share > 0.5:
            found.append(
                _contradiction(
                    source,
                    told.name,
                    f"wrong sign: {told.name} against {FOLLOWS[told.name]} contradicts axes = "
                    f"{axes!r} in {100.0 * told.share:.0f} % of the samples with {angles}",
                    f"{told.name} and {FOLLOWS[told.name]} have {signs_of(told.name, axes)} in "
                    "these axes",
                    rules,
                )
            )
            break  # a lateral force that is turned turns what the moment is held to
    return found


def _finite(rig: Mapping[str, FloatArray]) -> bool:
    names = ("Fy", "Mz", "slip_angle", "Fz", "camber", "slip_ratio")
    return all(np.isfinite(rig[name]).all() for name in names if name in rig)


def _contradiction(
    source: str, quantity: str, given: str, allowed: str, rules: ImportMap
) -> RunFinding:
    column = rules.channels[quantity].column
    place = f"column {column!r} ({quantity})"
    remedy = f"correct axes in {rules.file}, or write sign = -1 for the column that is turned"
    problem = CampaignFault(f"{source}, {place}", given, allowed, remedy)
    return RunFinding(f"sign {quantity}", source, place, problem)
