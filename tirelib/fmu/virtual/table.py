"""The variables of ``VirtualTire.fmu``: one ordered table. Value references follow its order."""

import math

from tirelib.fmu.variables import RIGHT, Variable, sample_rate
from tirelib.fmu.virtual.options import Options
from tirelib.fmu.virtual.surface import Surface

NAN = math.nan
START = {
    "Fz": 4000.0,
    "alpha": 0.0,
    "kappa": 0.0,
    "camber": 0.0,
    "speed": 20.0,
    "pressure": 2.3e5,
    "friction": 0.95,
}
"""Inputs before a host sets them."""


def parameters(rate: float) -> list[Variable]:
    """Return the parameters, fixed after initialisation."""
    usual = Options()
    return [
        sample_rate(rate),
        Variable(
            "relaxation_length",
            "Real",
            "parameter",
            "relaxation length of the slip angle: distance after which 63 % of a step act; 0: none",
            usual.relaxation[0],
            "m",
            "mm",
            0.1,
            0.0,
            100.0,
            type="Length",
        ),
        Variable(
            "relaxation_length_kappa",
            "Real",
            "parameter",
            "relaxation length of the slip ratio; 0: none",
            usual.relaxation[1],
            "m",
            "mm",
            0.1,
            0.0,
            100.0,
            type="Length",
        ),
        Variable(
            "noise_std",
            "Real",
            "parameter",
            "standard deviation of the gages' noise",
            usual.noise,
            "1",
            "ustrain",
            1e-5,
            0.0,
            1.0,
            type="Strain",
        ),
        Variable(
            "start_angle",
            "Real",
            "parameter",
            "wheel angle at the start; 0: gages over the road",
            usual.start_angle,
            "rad",
            "deg",
            1.0,
            -math.pi,
            math.pi,
            type="Angle",
        ),
        Variable(
            "fault_start",
            "Real",
            "parameter",
            "time at which the faults begin",
            0.0,
            "s",
            None,
            1.0,
            0.0,
            type="Time",
        ),
        Variable(
            "saturation",
            "Real",
            "parameter",
            "magnitude of strain at which the amplifier saturates; 0: none",
            0.0,
            "1",
            "ustrain",
            1e-2,
            0.0,
            1.0,
            type="Strain",
        ),
        Variable(
            "drift",
            "Real",
            "parameter",
            "drift of all gages in strain per second",
            0.0,
            "1/s",
            "ustrain/s",
            1e-6,
            -1.0,
            1.0,
            type="StrainRate",
        ),
        Variable(
            "dropped_frames",
            "Real",
            "parameter",
            "probability that the frame of a step is lost",
            0.0,
            "1",
            "%",
            0.1,
            0.0,
            1.0,
            type="Ratio",
        ),
        Variable(
            "dead_gage",
            "Integer",
            "parameter",
            "number of a gage that reads zero; 0: none",
            0,
            low=0,
            high=5,
        ),
        Variable(
            "seed",
            "Integer",
            "parameter",
            "seed of noise and dropped frames; give every wheel its own",
            0,
            low=0,
            high=2**31 - 1,
        ),
    ]


def inputs(surface: Surface) -> list[Variable]:
    """Return the inputs of a surface, in its order."""
    range_ = {
        name: f"surface {low:.5g} .. {high:.5g}"
        for name, low, high in zip(surface.inputs, surface.low, surface.high, strict=True)
    }
    rows = {
        "Fz": ("vertical load", "N", "kN", 1e3, -1e5, 1e5, "Force"),
        "alpha": (
            "slip angle, ISO 8855: positive where the wheel moves to the left",
            "rad",
            "deg",
            0.1,
            -RIGHT,
            RIGHT,
            "Angle",
        ),
        "kappa": (
            "slip ratio (omega R_e - speed) / speed, negative when braking",
            "1",
            "%",
            0.1,
            None,
            None,
            "Ratio",
        ),
        "camber": (
            "camber angle, top to the right positive",
            "rad",
            "deg",
            0.1,
            -RIGHT,
            RIGHT,
            "Angle",
        ),
        "speed": ("travel speed, forward", "m/s", "km/h", 10.0, -150.0, 150.0, "Speed"),
        "pressure": ("inflation pressure (gauge)", "Pa", "bar", 1e5, 0.0, 2e6, "Pressure"),
        "friction": (
            "coefficient of friction of tread and road",
            "1",
            None,
            1.0,
            0.0,
            5.0,
            "Ratio",
        ),
    }
    return [
        Variable(
            name,
            "Real",
            "input",
            f"{meaning}; {range_[name]}",
            START[name],
            unit,
            display,
            nominal,
            low,
            high,
            type=kind,
        )
        for name, (meaning, unit, display, nominal, low, high, kind) in rows.items()
        if name in range_
    ]


def outputs(surface: Surface, samples: int) -> list[Variable]:
    """Return the outputs: what `VirtualWheel.outputs` gives, in its order."""
    table = []
    for sample in range(1, samples + 1):
        for gage, y in enumerate(surface.lateral, start=1):
            name = f"strain_{gage}" if samples == 1 else f"strain_{sample}_{gage}"
            which = "" if samples == 1 else f", sample {sample} of {samples}, oldest first"
            table.append(
                Variable(
                    name,
                    "Real",
                    "output",
                    f"strain at y = {1e3 * y:+g} mm (ISO){which}",
                    0.0,
                    "1",
                    "ustrain",
                    1e-3,
                    -1.0,
                    1.0,
                    type="Strain",
                )
            )
    force = {
        "Fx_rig": "force of the road along x, forward positive",
        "Fy_rig": "force of the road along y, left positive",
    }
    return [
        *table,
        Variable(
            "omega",
            "Real",
            "output",
            "turn rate of the wheel, positive forward",
            0.0,
            "rad/s",
            "rpm",
            10.0,
            -1e3,
            1e3,
            type="TurnRate",
        ),
        Variable(
            "wheel_angle",
            "Real",
            "output",
            "present wheel angle of the gages; 0: over the road, negative before it",
            0.0,
            "rad",
            "deg",
            1.0,
            -math.pi,
            math.pi,
            type="Angle",
        ),
        Variable(
            "alpha_relaxed",
            "Real",
            "output",
            "slip angle that acts on the tire after relaxation",
            NAN,
            "rad",
            "deg",
            0.1,
            type="Angle",
        ),
        Variable(
            "kappa_relaxed",
            "Real",
            "output",
            "slip ratio that acts on the tire after relaxation",
            NAN,
            "1",
            "%",
            0.1,
            type="Ratio",
        ),
        *(
            Variable(
                name,
                "Real",
                "output",
                f"{text}, at the frame's last sample",
                NAN,
                "N",
                None,
                1e3,
                type="Force",
            )
            for name, text in force.items()
        ),
        Variable(
            "Mz_rig",
            "Real",
            "output",
            "aligning moment, at the frame's last sample",
            NAN,
            "N m",
            None,
            1e2,
            type="Moment",
        ),
        Variable(
            "loaded_radius",
            "Real",
            "output",
            "distance of axle and road in the wheel plane",
            NAN,
            "m",
            "mm",
            0.3,
            type="Length",
        ),
        Variable(
            "rolling_radius",
            "Real",
            "output",
            "effective rolling radius R_e",
            NAN,
            "m",
            "mm",
            0.3,
            type="Length",
        ),
        Variable(
            "samples",
            "Integer",
            "output",
            "how many samples of the frame are new",
            0,
            low=0,
            high=samples,
        ),
        Variable(
            "frame_valid",
            "Boolean",
            "output",
            "false: the frame is that of an earlier step, status says why",
            False,
        ),
        Variable(
            "moving", "Boolean", "output", "false: the wheel does not turn, the strain stays", False
        ),
        Variable(
            "status",
            "String",
            "output",
            "ok; standstill; locked; out_of_range with the inputs; frame_dropped; names of faults",
            "not_started",
        ),
    ]
