"""What a recording holds beside the raw bytes, as other programs list and plot it.

JSON messages with a JSON schema each (``json``, ``jsonschema`` in the MCAP registry). Units at this
edge are those of the live page's document, named in the field or in the description. A number that
is not known is null.
"""

import json
import math
from typing import Any

import numpy as np
import orjson

from tirebench.recording.document import QUANTITIES
from tirebench.wire.conditions import QUANTITIES as CONDITION_UNITS
from tirebench.wire.conditions import Measured
from tirebench.wire.frames import GAGES
from tirebench.wire.timeline import Samples
from tirelib.core.units import from_si

RAW, EVENTS, CONDITIONS, LINE = "/raw/{}", "/events", "/conditions", "/line"
STRAIN, ESTIMATE, LINK, BUS_CONDITION = (
    "/wheel/{}/strain",
    "/wheel/{}/estimate",
    "/wheel/{}/link",
    "/wheel/{}/conditions",
)
SAMPLES = 16
"""Samples of a message of strain: one of SERIAL v1. The first of each alone is a wave of 625 Hz."""
_ARRAYS = orjson.OPT_SERIALIZE_NUMPY  # which writes NaN as null
_GAGES = [f"gage_{number}" for number in range(1, GAGES + 1)]

Schema = tuple[str, bytes]


def _schema(name: str, says: str, properties: dict[str, Any]) -> Schema:
    document = {"title": name, "type": "object", "description": says, "properties": properties}
    return name, json.dumps(document).encode()


def _number(says: str = "") -> dict[str, Any]:
    return {"type": ["number", "null"], "description": says}


def field_of(name: str) -> str:
    """Return the field of a condition, its unit in the name: ``speed_kmh``."""
    return f"{name}_{CONDITION_UNITS[name][0].replace('/', '')}"


_TEXT = {"type": "string"}
_COUNT = {"type": "integer"}
EVENT_SCHEMA = _schema(
    "tirebench.Event",
    "Events of the run, and markers that the user set.",
    {"event": _TEXT, "text": _TEXT, "wheel": _COUNT},
)
CONDITIONS_SCHEMA = _schema(
    "tirebench.Conditions", "Speed, pressure and camber over device time.", {"format": _TEXT}
)
STRAIN_SCHEMA = _schema(
    "tirebench.Strain",
    "Consecutive samples; the message's time is that of the first sample.",
    {
        "segment": _COUNT,
        "t_us": {"type": "integer", "description": "Device time of the first sample, in us."},
        "period_us": _number("Time between two samples, in us."),
        **{name: {"type": "array", "items": _number("microstrain")} for name in _GAGES},
    },
)
ESTIMATE_SCHEMA = _schema(
    "tirebench.Estimate",
    "Estimates of one turn in ISO 8855 axes, as in the run's JSON.",
    {
        **{
            f"{name}{end}": _number(f"{unit}{said}")
            for name, (unit, _) in QUANTITIES.items()
            for end, said in (("", ""), ("_std", ", standard deviation"))
        },
        "valid": {"type": "boolean"},
        "omega_rad_s": _number("rad/s"),
        "flags": {"type": "array", "items": _TEXT},
    },
)
LINK_SCHEMA = _schema(
    "tirebench.Link",
    "Counters of good frames and of each kind of loss.",
    {"frames": _COUNT, "lost_frames": _COUNT, "crc_bad": _COUNT, "clock_drift_ppm": _number("ppm")},
)
BUS_CONDITION_SCHEMA = _schema(
    "tirebench.Told",
    "Conditions that a bus sent, written at each change.",
    {field_of(name): _number(unit) for name, (unit, _) in CONDITION_UNITS.items()},
)


def strain_messages(samples: Samples) -> list[tuple[int, bytes]]:
    """Return samples as messages: offset of the first sample [ns], and JSON."""
    period, tenths = samples.period, np.round(1e6 * samples.strain.T, 1)
    messages = []
    for start in range(0, tenths.shape[1], SAMPLES):
        offset = start * period
        document: dict[str, Any] = {
            "segment": samples.segment,
            "t_us": samples.t_us + round(1e6 * offset),
            "period_us": round(1e6 * period, 4),
        }
        for number, row in enumerate(tenths, start=1):
            document[f"gage_{number}"] = row[start : start + SAMPLES].copy()
        messages.append((round(1e9 * offset), orjson.dumps(document, option=_ARRAYS)))
    return messages


def bus_condition_message(measured: Measured) -> bytes:
    """Return the message of a condition from a bus; an unknown quantity stays in SI."""
    value, name = measured.value, measured.name
    if name in CONDITION_UNITS:
        value, name = from_si(value, *CONDITION_UNITS[name]), field_of(name)
    return json.dumps({name: value if math.isfinite(value) else None}).encode()
