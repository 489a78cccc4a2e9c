"""The variables of ``StrainTire.fmu``: one ordered table. Value references follow its order."""

import math

from tirelib.core.flags import TurnFlag
from tirelib.estimators.estimate import QUANTITIES
from tirelib.estimators.unknowns import Road
from tirelib.fmu.variables import RIGHT, Variable, sample_rate

NAN = math.nan
TYPE = {"Fz": "Force", "alpha": "Angle", "kappa": "Ratio", "Fy": "Force"}
LIMITS = {"Fz": (-1e5, 1e5), "alpha": (-RIGHT, RIGHT), "kappa": (None, None), "Fy": (-1e5, 1e5)}
"""A number outside means that the wiring is wrong; no value is clamped to them."""
UNITS = {"Fz": "N", "alpha": "rad", "kappa": "1", "Fy": "N"}
DISPLAY = {"Fz": None, "alpha": "deg", "kappa": "%", "Fy": None}
MEANING = {
    "Fz": "vertical load, positive in iso and adapted_sae",
    "alpha": "slip angle, positive in iso and adapted_sae where the wheel moves to the left of "
    "where it points",
    "kappa": "slip ratio (omega R_e - speed) / speed, negative when braking",
    "Fy": "lateral force of the road on the tire, positive to the left in iso and to the right in "
    "sae and adapted_sae",
}
MISSING = "missing"
"""Name of the parameter that sets what Real outputs show where there is no value."""


def parameters(rate: float, missing: float = NAN) -> list[Variable]:
    """Return the parameters, fixed after initialisation."""
    return [
        sample_rate(rate),
        Variable(
            "filter_order",
            "Real",
            "parameter",
            "cut-off of the low-pass filter in cycles per turn: a check that the calibration was "
            "made with this cut-off; 0: no check",
            0.0,
            "1",
            None,
            10.0,
            0.0,
            1e3,
            type="Ratio",
        ),
        Variable(
            MISSING,
            "Real",
            "parameter",
            "what Real outputs show where there is no value, as before the first turn: NaN, or a "
            "number for importers that do not accept NaN; valid and flags do not depend on it",
            missing,
            "1",
            None,
            1.0,
            -1e9,
            1e9,
            type="Ratio",
        ),
        Variable(
            "axes",
            "String",
            "parameter",
            "axis system of the outputs and of the order of the gages: iso, sae or adapted_sae; "
            "speed, omega and camber have the same signs in all three",
            "iso",
        ),
        Variable(
            "calibration",
            "String",
            "parameter",
            "path of another calibration of the same tire and gage layout; empty: the embedded one",
            "",
        ),
        Variable(
            "tire",
            "String",
            "parameter",
            "name of the tire on the wheel, for which the calibration must be made; empty: that "
            "of the embedded calibration",
            "",
        ),
    ]


def inputs(
    lateral: tuple[float, ...],
    samples: int,
    *,
    buffered: bool = False,
    road: Road | None = None,
) -> list[Variable]:
    """Return the inputs: strain sample by sample, oldest first, then the conditions.

    `buffered` adds ``samples``, which says how many of the frame are new; `road` is that of the
    calibration: nothing is valid beyond its ends of friction, tread depth and tread temperature.
    """
    ends = (road or Road()).ends
    table = []
    for sample in range(1, samples + 1):
        for gage, y in enumerate(lateral, start=1):
            name = f"strain_{gage}" if samples == 1 else f"strain_{sample}_{gage}"
            which = "" if samples == 1 else f", sample {sample} of {samples}, oldest first"
            text = f"raw strain at lateral position {1e3 * y:+g} mm of the chosen axes{which}"
            table.append(
                Variable(
                    name,
                    "Real",
                    "input",
                    f"{text}; NaN: missing",
                    0.0,
                    "1",
                    "ustrain",
                    1e-3,
                    -1.0,
                    1.0,
                    type="Strain",
                )
            )
    table += [
        Variable(
            "speed",
            "Real",
            "input",
            "travel speed, positive forward; NaN: unknown",
            NAN,
            "m/s",
            "km/h",
            10.0,
            -150.0,
            150.0,
            type="Speed",
        ),
        Variable(
            "pressure",
            "Real",
            "input",
            "inflation pressure (gauge); NaN: unknown",
            NAN,
            "Pa",
            "bar",
            1e5,
            0.0,
            2e6,
            type="Pressure",
        ),
        Variable(
            "camber",
            "Real",
            "input",
            "camber angle, positive with the top of the wheel to the right; NaN: unknown, which "
            "makes Fy_std and alpha_std large if the calibration has one camber only "
            "(camber_unknown)",
            NAN,
            "rad",
            "deg",
            0.1,
            -RIGHT,
            RIGHT,
            type="Angle",
        ),
        Variable(
            "omega",
            "Real",
            "input",
            "measured turn rate, positive forward, whose change within the turn corrects the wheel "
            "angle; zero: standing; NaN: unknown",
            NAN,
            "rad/s",
            "rpm",
            10.0,
            -1e3,
            1e3,
            type="TurnRate",
        ),
        Variable(
            "friction",
            "Real",
            "input",
            "coefficient of friction between tread and road; NaN: unknown",
            NAN,
            "1",
            None,
            1.0,
            *ends["friction"],
            type="Ratio",
        ),
        Variable(
            "tread_depth",
            "Real",
            "input",
            "remaining depth of the tread grooves; NaN: unknown",
            NAN,
            "m",
            "mm",
            0.01,
            *ends["tread_depth"],
            type="Length",
        ),
        Variable(
            "tread_temperature",
            "Real",
            "input",
            "temperature of the tread's rubber; NaN: unknown",
            NAN,
            "K",
            None,
            300.0,
            *ends["tread_temperature"],
            type="Temperature",
        ),
        Variable(
            "frame_valid",
            "Boolean",
            "input",
            "false: the frame was lost or damaged, its samples are missing",
            True,
        ),
    ]
    if buffered:
        table.append(
            Variable(
                "samples",
                "Integer",
                "input",
                "number of new samples in the frame, oldest first; the step may have any length",
                0,
                low=0,
                high=samples,
            )
        )
    return table


def outputs(lateral: tuple[float, ...]) -> list[Variable]:
    """Return the outputs: what `Wheel.outputs` gives, in its order."""
    nominal = {"Fz": 1e3, "alpha": 0.1, "kappa": 0.1, "Fy": 1e3}
    table = [
        Variable(
            q,
            "Real",
            "output",
            f"{MEANING[q]}; NaN: no estimate",
            NAN,
            UNITS[q],
            DISPLAY[q],
            nominal[q],
            *LIMITS[q],
            type=TYPE[q],
        )
        for q in QUANTITIES
    ]
    table += [
        Variable(
            f"{q}_std",
            "Real",
            "output",
            f"standard deviation of {q}",
            NAN,
            UNITS[q],
            DISPLAY[q],
            0.01 * nominal[q],
            0.0,
            type=TYPE[q],
        )
        for q in QUANTITIES
    ]
    table += [
        Variable(
            f"contact_length_{gage}",
            "Real",
            "output",
            "contact length, corrected for the bias of the edge detection, at lateral position "
            f"{1e3 * y:+g} mm of the chosen axes",
            NAN,
            "m",
            "mm",
            0.1,
            0.0,
            1.0,
            type="Length",
        )
        for gage, y in enumerate(lateral, start=1)
    ]
    table += [
        Variable(
            f"contact_length_std_{gage}",
            "Real",
            "output",
            f"standard deviation of contact_length_{gage}",
            NAN,
            "m",
            "mm",
            0.01,
            0.0,
            1.0,
            type="Length",
        )
        for gage in range(1, len(lateral) + 1)
    ]
    return [
        *table,
        Variable(
            "rolling_radius",
            "Real",
            "output",
            "effective rolling radius",
            NAN,
            "m",
            "mm",
            0.3,
            0.0,
            2.0,
            type="Length",
        ),
        Variable(
            "turn_rate",
            "Real",
            "output",
            "turn rate from the contacts in the strain",
            NAN,
            "rad/s",
            "rpm",
            10.0,
            0.0,
            type="TurnRate",
        ),
        Variable(
            "contact_time",
            "Real",
            "output",
            "time of the middle of the contact since the first sample",
            NAN,
            "s",
            "ms",
            1.0,
            0.0,
            type="Time",
        ),
        Variable(
            "age",
            "Real",
            "output",
            "time since the estimate was made",
            NAN,
            "s",
            "ms",
            0.1,
            0.0,
            type="Time",
        ),
        Variable("turn", "Integer", "output", "number of contacts since the start", 0, low=0),
        Variable(
            "flags",
            "Integer",
            "output",
            "sum of the flag bits, whose names are in status",
            1,
            low=0,
            high=2 * max(TurnFlag) - 1,
        ),
        Variable("valid", "Boolean", "output", "every calibrated quantity is valid now", False),
        *(
            Variable(f"{q}_valid", "Boolean", "output", f"{q} is valid now", False)
            for q in QUANTITIES
        ),
        Variable("rolling", "String", "output", "free, braking, driving or unknown", "unknown"),
        Variable(
            "status",
            "String",
            "output",
            "names of flags and notes, separated by semicolons; the cause of a fault or of a "
            "refused step",
            "first_turn",
        ),
    ]
