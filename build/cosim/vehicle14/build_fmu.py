"""Write ``VehicleModel.fmu``; not part of the FMU.

python -m cosim.vehicle14.build_fmu --out build/out/VehicleModel.fmu
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np

from cosim.vehicle14 import port
from cosim.vehicle14.files import TIRE_FILE, usual_tires
from tirelib.core.arrays import FloatArray
from tirelib.core.threads import one_thread
from tirelib.fmu.bundle import content_hash
from tirelib.fmu.export import export
from tirelib.fmu.handbook import page
from tirelib.fmu.parts import source_file
from tirelib.fmu.reference import FOLDER, Reference
from tirelib.fmu.spec import SlaveSpec
from tirelib.fmu.variables import Variable

MODEL = "VehicleModel"
PARTS = ("__init__.py", "model.py", "parameters.py", "port.py", "run.py", "tire.py")
"""Modules that the FMU carries."""
TIME_STEP, STEP_COUNT = 1e-3, 150
_LEAD = (
    "A car with 14 degrees of freedom: body 6, suspension 4, wheel spin 4; steering, drive and "
    "brake torques, friction and height of the road at each wheel in; load, slip, camber, speed "
    "and forces of each wheel out."
)
_CONVENTIONS = """<p>ISO 8855: x forward, y left, z up. A positive slip angle gives a negative Fy;
the slip ratio is (omega R_e - speed) / speed with the travel speed; camber is positive where the
top leans to the right, on both sides. Wheels: FL, FR, RL, RR.</p>"""
_LIMITS = """<ul>
<li>Wheels move along the body's vertical axis: no kinematics of a suspension, no toe or camber
change but that of the body; roll centres lie on the road.</li>
<li>No gyroscopic moments, no wheel hop of the tire's belt, no steering system.</li>
<li>Tires: brush, first-order relaxation; the friction scale acts on sliding only.</li>
<li>Brakes fade below 1 rad/s: the model ends before standstill.</li>
</ul>"""


def vehicle_spec() -> SlaveSpec:
    """Return what `tirelib.fmu.export.export` needs."""
    here = Path(__file__).parent
    parts = {name: (here / name).read_text(encoding="utf-8") for name in PARTS}
    library = f"vehicle14_{content_hash(parts)}"
    table = [*port.parameters(Variable), *port.inputs(Variable), *port.outputs(Variable)]
    signals = reference_signals()
    return SlaveSpec(
        model=MODEL,
        script="vehicle_model.py",
        description="Car with 14 degrees of freedom: controls and road in, wheels out",
        table=table,
        step_size=TIME_STEP,
        settings={"library": library},
        resources={
            "tire.toml": TIRE_FILE.read_bytes(),
            **{f"{library}/{name}": text.encode() for name, text in parts.items()},
            **{f"{FOLDER}/{name}": data for name, data in signals.files(MODEL).items()},
        },
        documentation={"index.html": _page(table).encode()},
        icon=source_file("strain_tire.png").read_bytes(),
    )


def build_vehicle(out: str | Path) -> Path:
    """Write the FMU.

    Raises
    ------
    FormatError
        If it cannot be written.
    """
    return export(vehicle_spec(), out)


def _page(table: list[Variable]) -> str:
    facts = {
        "communication step": f"up to {port.LONGEST_STEP:g} s; divided by longest_step",
        "needs": "CPython 3.11 or newer with numpy and scipy; linux64 or win64",
        "version": "{version}",
        "licences": "documentation/licenses: MIT, tirelib and pythonfmu",
    }
    return page(MODEL, _LEAD, facts, table, {"Conventions": _CONVENTIONS, "Limits": _LIMITS})


def reference_signals() -> Reference:
    """Return input and expected output: steer, then brakes on a split road, over a bump."""
    time: FloatArray = TIME_STEP * np.arange(STEP_COUNT, dtype=np.float64)
    usual = {v.name: float(v.start) for v in port.inputs(Variable)}
    given: dict[str, FloatArray] = {name: np.full(STEP_COUNT, usual[name]) for name in port.INPUTS}
    given["steer_front"] = np.where(time > 0.01, 0.02, 0.0)
    for wheel, torque in zip(("FL", "FR", "RL", "RR"), (900.0, 900.0, 300.0, 300.0), strict=True):
        given[f"brake_{wheel}"] = np.where(time > 0.05, torque, 0.0)
    given["friction_FL"] = np.where(time > 0.08, 0.6, 1.0)
    given["road_RR"] = np.where((time > 0.1) & (time < 0.12), 0.01, 0.0)
    start = [float(v.start) for v in port.parameters(Variable)]
    rows = np.stack([given[name] for name in port.INPUTS], axis=1)
    vehicle = port.Port(usual_tires(), start, rows[0].tolist())
    shown = [_row(vehicle)]
    for row in rows[:-1]:
        vehicle.step(TIME_STEP, row.tolist())
        shown.append(_row(vehicle))
    names = [v.name for v in port.outputs(Variable) if v.kind != "String"]
    found = np.array(shown)
    return Reference(TIME_STEP, given, {name: found[:, i] for i, name in enumerate(names)})


def _row(vehicle: port.Port) -> list[float]:
    values, (valid, _) = vehicle.outputs()
    if not all(map(math.isfinite, values)):
        raise ValueError("the reference signals leave what the vehicle can tell")
    return [*values, float(valid)]


def main(arguments: list[str] | None = None) -> int:
    """Build by the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/out/VehicleModel.fmu"))
    out = build_vehicle(parser.parse_args(arguments).out)
    sys.stdout.write(f"{out}: {out.stat().st_size} bytes\n")
    return 0


if __name__ == "__main__":
    with one_thread():
        sys.exit(main())
