"""Results as pandas tables: SI units and radians, ISO 8855 axes, as everything in Python.

The tables that verbs write have the units of engineers; these have those of the library. The unit
of a column is in ``table.attrs["units"]``.
"""

from typing import TYPE_CHECKING

import numpy as np

from tirelib.core.errors import ParameterError
from tirelib.core.flags import flag_names
from tirelib.core.units import TABLE

if TYPE_CHECKING:
    import pandas as pd

    from tirelib.core.parameters import TireFile
    from tirelib.estimators.estimate import Estimates
    from tirelib.inference.diagnose.assess import Assessment, ForceAssessment
    from tirelib.measured.observations import Observations

UNITS = {"time": "s", "Fz": "N", "alpha": "rad", "kappa": "1", "Fy": "N"}
SI_UNITS = {
    row.dimension: row.unit for row in reversed(TABLE) if row.factor == 1.0 and row.offset == 0.0
}
"""SI unit of each dimension."""


def feature_table(observed: "Observations") -> "pd.DataFrame":
    """Return the features of every turn and gage.

    Parameters
    ----------
    observed : Observations
        Observations of n turns, from `tirelib.observe`.

    Returns
    -------
    DataFrame
        A row for each turn and gage, n times the number of gages; ``run`` and the columns of
        `tirelib.measured.features.table.feature_frame`.
    """
    from tirelib.measured.features.table import feature_frame, units

    table = feature_frame(observed.features, campaign=observed.campaign, run=observed.run)
    table.attrs["units"] = dict(units())
    return table


def estimate_table(observed: "Observations", estimates: "Estimates") -> "pd.DataFrame":
    """Return the estimates of every turn beside what the rig measured.

    Parameters
    ----------
    observed : Observations
        Observations of n turns.
    estimates : Estimates
        Estimates of the same turns.

    Returns
    -------
    DataFrame
        n rows: ``campaign``, ``run``, ``time``; for each quantity ``Fz``, ``Fz_std``, ``Fz_valid``
        and, where the rig measured it, ``Fz_measured``; ``valid`` and ``flags`` of the turn.

    Raises
    ------
    ParameterError
        If the two hold different numbers of turns.
    """
    if len(observed) != len(estimates.flags):
        raise ParameterError(
            f"estimate_table: {len(observed)} turns observed and {len(estimates.flags)} estimated; "
            "both must be of the same turns; give calibration.estimate(observed.features)"
        )
    import pandas as pd  # slow to import

    from tirelib.estimators.crossval import TRUTH_NAME

    columns: dict[str, object] = {
        "campaign": observed.campaign,
        "run": observed.run,
        "time": observed.features.time,
    }
    units = {"time": UNITS["time"]}
    for name, value in estimates.value.items():
        columns |= {name: value, f"{name}_std": estimates.std[name]}
        columns[f"{name}_valid"] = estimates.valid[name]
        units |= dict.fromkeys((name, f"{name}_std"), UNITS[name])
        if TRUTH_NAME[name] in observed.truth:
            columns[f"{name}_measured"] = observed.truth[TRUTH_NAME[name]]
            units[f"{name}_measured"] = UNITS[name]
    columns["valid"] = estimates.turn_valid
    columns["flags"] = [", ".join(flag_names(int(flag))) for flag in estimates.flags]
    table = pd.DataFrame(columns)
    table.attrs["units"] = units
    return table


def parameter_table(model: "TireFile") -> "pd.DataFrame":
    """Return the numbers of a tire or model, with what is known about each.

    Parameters
    ----------
    model : TireFile
        For example ``tirelib.identify(campaign).file``.

    Returns
    -------
    DataFrame
        A row for each number, by name: ``value``, ``std``, ``low`` and ``high`` of the 95 %
        interval, all of them in ``unit``; ``kind``, ``flags``, ``source``.

    Examples
    --------
    >>> from tirelib import parameter_table, read_tire
    >>> parameter_table(read_tire("table-6-1")).loc["bending_stiffness", "unit"]
    'N m^2'
    """
    import pandas as pd  # slow to import

    from tirelib.core.parameters import NUMBERS

    nothing = [np.nan, np.nan]
    rows = {}
    for name, number in model.numbers.items():
        low, high = number.notes.get("interval_SI", nothing)
        rows[name] = {
            "value": number.value,
            "std": number.std,
            "low": low,
            "high": high,
            "unit": SI_UNITS[NUMBERS[name].dimension],
            "kind": number.kind,
            "flags": ", ".join(number.notes.get("flags", ())),
            "source": number.source,
        }
    return pd.DataFrame.from_dict(rows, orient="index")


def candidate_table(found: "Assessment | ForceAssessment") -> "pd.DataFrame":
    """Return what a diagnosis says of each effect, best first.

    Parameters
    ----------
    found : Assessment or ForceAssessment
        From `tirelib.diagnose`.

    Returns
    -------
    DataFrame
        A row for each effect, by name, with the keys of a candidate in ``tirelib diagnose --json``
        as columns; ``strength`` in ``unit``.
    """
    import pandas as pd  # slow to import

    from tirelib.inference.diagnose.document import diagnosis_document

    return pd.DataFrame(diagnosis_document(found)["candidates"]).set_index("effect")
