"""What a recording takes of disk and processor: raw bytes alone, and with all that stands beside.

    python build/bench_recording.py CAMPAIGN

Turns of the numerical rig roll on at 10 kHz, once over SERIAL v1 and once as four wheels over slcan
FD, through decoder and recorder as fast as they go, with a chunk closed every 0.25 s of their time.
"""

import argparse
import json
import math
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tirebench.emulator.emulator import Player, record_tape
from tirebench.emulator.faults import Faults
from tirebench.estimator.chain import Turn
from tirebench.estimator.wheels import Wheels
from tirebench.links import Read
from tirebench.protocols import SERIAL, SLCAN
from tirebench.protocols.layouts import RAW16
from tirebench.protocols.plan import ProtocolPlan
from tirebench.protocols.transmitter import transmitter
from tirebench.recording.document import line_document, turn_document, wheel_document
from tirebench.recording.header import RecordingHeader
from tirebench.recording.recorder import Recorder
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device
from tirelib.campaign import read_campaign
from tirelib.core.threads import one_thread

READ, CHUNK = 0.004, 0.25
"""What a read brings and what a chunk holds, [s]."""
TURNS = 14
"""A second and wheel."""


def pieces(
    campaign: Path, line: str, kind: str, wheels: tuple[int, ...], seconds: float = 10.0
) -> tuple[float, list[bytes]]:
    """Return the length of a campaign's first run, again and again, and its bytes read by read."""
    source = read_campaign(campaign)
    run = next(source.runs())
    if run.strain is None:
        raise SystemExit(f"{campaign}: its first run has no strain; name a campaign that has")
    times = math.ceil(seconds * run.rate / run.strain.shape[1])
    runs = [
        replace(run, strain=np.tile(run.strain, (1, times)), trigger=None, rig={}, rig_time=None)
    ]
    tape = record_tape(runs, Device(), Faults({}), wheels, source.header)
    frames = [
        (due, frame)
        for piece in Player(transmitter(kind), line, Faults({})).pieces(tape)
        for due, frame in zip(piece.due, piece.frames, strict=True)
    ]
    found: dict[int, list[bytes]] = {}
    for due, frame in frames:
        found.setdefault(int(due / READ), []).append(frame)
    return float(frames[-1][0]), [b"".join(found[place]) for place in sorted(found)]


def recorded(
    path: Path, line: str, reads: list[bytes], length: float, *, beside: bool
) -> tuple[float, int, int]:
    """Record; return the processor's time [s], bytes of the file, and raw bytes."""
    protocol = ProtocolPlan(line, 1e4)
    wheels = Wheels.of_one(protocol.decoder(), {None: Device()})
    header = RecordingHeader({}, protocol=protocol.as_header())
    used, start = 0.0, header.monotonic_ns
    with Recorder(path, header, Conditions.constant(18.0)) as recorder:
        for number, data in enumerate(reads):
            read = Read(start + round(1e9 * READ * number), data)
            blocks = wheels.push(read.data, read.arrival) if beside else []
            before = time.process_time()
            recorder.read(read)
            for block in blocks:
                recorder.block(block)
            if number % round(CHUNK / READ) == 0:
                recorder.flush()
            rest = number % round(1.0 / READ)
            if beside and rest < TURNS:
                for wheel in wheels.heard:
                    recorder.estimate(wheel, read.arrival, ESTIMATE)
                    if rest == 0:
                        recorder.link(wheel, wheel_document(wheels, wheel))
            if beside and rest == 0:
                recorder.link(None, line_document(*wheels.counts))
            used += time.process_time() - before
    return used, path.stat().st_size, sum(map(len, reads))


def write(text: str) -> None:
    """Print a line."""
    sys.stdout.write(f"{text}\n")


OUTPUTS = {
    name: 1234.5678 / (i + 1)
    for i, name in enumerate(
        ("Fz", "alpha", "kappa", "Fy", "Fz_std", "alpha_std", "kappa_std", "Fy_std", "turn_rate")
    )
}
ESTIMATE = json.dumps(
    turn_document(Turn(1, 0, 12.345678, 12.4, 12.4, {**OUTPUTS, "valid": 1.0}, {}, 0, (0,) * 5))
).encode()


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaign", type=Path, help="any campaign with strain")
    campaign = parser.parse_args().campaign
    write("line                   raw        file, raw alone   file, all    CPU, raw   CPU, all")
    with tempfile.TemporaryDirectory() as folder:
        for name, line, kind, wheels in (
            ("SERIAL v1, 1 wheel", SERIAL, "serial", (0,)),
            ("slcan FD, 4 wheels", SLCAN, RAW16, (0, 1, 2, 3)),
        ):
            length, reads = pieces(campaign, line, kind, wheels)
            row = []
            for beside in (False, True):
                path = Path(folder) / f"{len(wheels)}{beside}.mcap"
                row.append(recorded(path, line, reads, length, beside=beside))
            hour = 3600.0 / length / 1e9
            (bare, small, raw), (full, large, _) = row
            write(
                f"{name}  {raw * hour:6.2f} GB/h  {small * hour:6.2f} GB/h     "
                f"{large * hour:6.2f} GB/h  {100 * bare / length:5.1f} %  "
                f"{100 * full / length:5.1f} %"
            )


if __name__ == "__main__":
    with one_thread():
        main()
