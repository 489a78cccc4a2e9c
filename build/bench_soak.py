"""A day of one wheel as fast as it goes: ``make soak`` or ``python build/bench_soak.py --hours 2``.

The bench's own decoder, line of samples, clock fit, FMU and recorder take the bytes of one wheel at
10 kHz, with frames damaged, lost and doubled and a quartz that is 50 ppm fast, and must not drift:
memory, counters, clock and estimates are written down every ten minutes of simulated time. The
waveform is one measured turn of the rig, again and again, so that every clean turn must give the
same estimate. Two things are not as at the bench: a read brings 40 frames, and the arrivals are
made up. A recording of each simulated hour is written, checked when it is the last, and removed.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bench_demo import ready_fmu
from demo import ROOT, Steps
from rich.console import Console

from tirebench.deadline import Deadline
from tirebench.emulator.faults import Faults
from tirebench.estimator.chain import Turn
from tirebench.estimator.estimation import Estimation
from tirebench.estimator.fmu_archive import read_fmu
from tirebench.estimator.fmu_model import FmuFile, FmuModel
from tirebench.estimator.wheels import Wheels
from tirebench.links import Read
from tirebench.protocols import SERIAL
from tirebench.protocols.plan import ProtocolPlan
from tirebench.recording.document import line_document, wheel_document
from tirebench.recording.recording import Recorder, Recording, RecordingHeader
from tirebench.recording.replay import ReplayChain
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import Device
from tirebench.wire.frames import SAMPLES, TICK, encode, strain_frames
from tirelib.campaign import Run, read_campaign
from tirelib.core.threads import one_thread

OUT = ROOT / "build/out/bench-soak"
RATES = {"flips": 2e-4, "lost": 2e-4, "dup": 2e-4}
"""Faults a frame: one of the three every 2.7 s."""
PERIOD = 1000
"""Sample period in ticks of 0.1 us."""
TURN_FRAMES = 67
"""Frames that one turn fills exactly: 1072 samples, 9.3 turns a second."""
BLOCK_TURNS = 40
READ_FRAMES = 40
SAMPLES_PER_STEP = 256
"""Samples that the FMU takes a step; the estimates are those of any other number."""
FAST = 50.0
"""The wheel's quartz against the host's, [ppm]."""
LATENCY = (5e-5, 7e-5)
"""Smallest, and mean beyond it, of the way from wheel to host, [s]; as measured on a terminal."""
EVERY = 600.0
"""Simulated time between two samples, [s]."""
WARM = 1800.0
"""Memory is judged from here on, [s]."""
MOST_GROWTH = 8 * 2**20
"""Growth of the memory that an allocator may keep back, [bytes]."""
MOST_PPM = 1.0
"""How far the clock fit may be off, [ppm]; its own scatter with these arrivals is 0.2 ppm."""
CLEAN_FZ = 1e-9
"""Largest relative drift of the median of Fz, the same bytes coming again and again."""


@dataclass(frozen=True, slots=True)
class Sample:
    """What stood on the counters after so much simulated time."""

    hours: float
    cpu_s: float
    wall_s: float
    rss_bytes: int
    turns: int
    clean_turns: int
    drift_ppm: float
    residual_us: float
    Fz_N: float
    Fz_spread_N: float
    line: dict[str, Any]
    done: dict[str, int]


def one_turn(run: Run) -> tuple[np.ndarray, float]:
    """Return counts of one turn, shape (n, 5), joined smoothly at its ends, and its speed [m/s].

    The speed is that at which the turn, stretched to whole frames, is rolled.
    """
    strain, samples = np.asarray(run.strain), TURN_FRAMES * SAMPLES
    length = 2.0 * np.pi / float(run.mean("omega") or np.nan) * run.rate
    contact = int(np.argmax(strain[2, : int(3.0 * length)][int(1.5 * length) :])) + int(
        1.5 * length
    )
    place = contact + length * (np.arange(samples) / samples - 0.5)
    index = np.arange(strain.shape[1])
    turn = np.array([np.interp(place, index, gage) for gage in strain])
    step = np.array([np.interp(place[0] + length, index, gage) for gage in strain]) - turn[:, 0]
    turn -= step[:, None] * (np.arange(samples) / samples - 0.5)
    counts, _ = Device().counts(turn.T)
    return counts, float(run.mean("speed") or np.nan) * length / samples


class Wire:
    """The bytes of a wheel that rolls on; see `tirebench.links.Link`.

    Frames are struck read by read, so that what was done is never ahead of what was sent, and the
    last ones are sound, so that what was lost before them shows.

    Attributes
    ----------
    moment : float, [s]
        Simulated time of the wheel's clock.
    """

    name, live, encoding = "soak", False, SERIAL

    def __init__(self, counts: np.ndarray, faults: Faults, hours: float, to: "Hourly") -> None:
        self.moment = 0.0
        self._reads, self._to = self._made(counts, faults, hours), to

    def receive(self, deadline: Deadline) -> Read | None:
        """Return the next read, which is recorded; None at the end."""
        read = next(self._reads, None)
        if read is not None:
            self._to.write(read, self.moment)
        return read

    def _made(self, counts: np.ndarray, faults: Faults, hours: float) -> Iterator[Read]:
        rng = np.random.default_rng(1)
        block = np.tile(counts, (BLOCK_TURNS, 1))
        number, period_us, sound = 0, SAMPLES * PERIOD / 10.0, False
        while not sound:
            sound = number * period_us >= 3.6e9 * hours
            made = strain_frames(block, period=PERIOD, seq=number, t_us=round(number * period_us))
            frames = encode(made)
            for first in range(0, len(frames), READ_FRAMES):
                some = frames[first : first + READ_FRAMES]
                self.moment = (number + first + len(some)) * period_us * 1e-6
                host = 1000.0 + self.moment / (1.0 + 1e-6 * FAST)
                late = LATENCY[0] + rng.exponential(LATENCY[1])
                data = b"".join(some if sound else faults.wire(some))
                yield Read(round(1e9 * (host + late)), data)
            number += len(made)


def rss() -> int:
    """Return the memory of this process that is in use, [bytes]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


class Notes:
    """What is written down of a chain."""

    def __init__(self, wheels: Wheels, faults: Faults) -> None:
        self.samples: list[Sample] = []
        self._wheels, self._faults = wheels, faults
        self._turns = self._clean = 0
        self._loads: list[float] = []
        self._start = time.process_time(), time.monotonic()

    def take(self, turns: Sequence[Turn]) -> None:
        """Count turns, and keep the loads of those that nothing struck."""
        clean = [turn.outputs["Fz"] for turn in turns if turn.valid and not turn.flags]
        self._turns += len(turns)
        self._clean += len(clean)
        self._loads += clean

    def sample(self, moment: float) -> Sample:
        """Write down where things stand."""
        clock = wheel_document(self._wheels, 0)
        loads, self._loads = np.array(self._loads), []
        one = Sample(
            hours=moment / 3600.0,
            cpu_s=time.process_time() - self._start[0],
            wall_s=time.monotonic() - self._start[1],
            rss_bytes=rss(),
            turns=self._turns,
            clean_turns=self._clean,
            drift_ppm=clock["clock_drift_ppm"],
            residual_us=clock["clock_residual_us"],
            Fz_N=float(np.median(loads)),
            Fz_spread_N=float(np.ptp(loads)),
            line=line_document(*self._wheels.counts),
            done=dict(self._faults.done),
        )
        self.samples.append(one)
        return one


class Hourly:
    """A recording for each simulated hour; the one before is removed."""

    def __init__(self, folder: Path, conditions: Conditions) -> None:
        self.bytes = 0
        self._folder, self._conditions = folder, conditions
        self._hour, self._recorder = -1, None

    def write(self, read: Read, moment: float) -> None:
        """Write one read, as a run does: so that it would outlive this process."""
        if int(moment / 3600.0) != self._hour:
            self._begin(int(moment / 3600.0))
        self._recorder.read(read)
        self._recorder.flush()

    def _begin(self, hour: int) -> None:
        self.close()
        self._hour = hour
        for old in self._folder.glob("hour-*.mcap"):
            old.unlink()
        file = self._folder / f"hour-{hour:02d}.mcap"
        header = RecordingHeader({"soak": True}, protocol=ProtocolPlan().as_header())
        self._recorder = Recorder(file, header, self._conditions)

    def close(self) -> None:
        """Finish the last recording."""
        if self._recorder is not None:
            self.bytes += self._recorder.bytes
            self._recorder.close("soak")

    def readable(self) -> bool:
        """Tell whether the last recording holds every byte that was written into it."""
        recording = Recording(self._recorder.path)
        held = sum(len(data) for _, data in recording.raw())
        recording.close()
        return held == self._recorder.bytes and recording.complete is True


def judge(samples: list[Sample]) -> dict[str, bool]:
    """Tell what drifted: true is good."""
    warm = [s for s in samples if 3600.0 * s.hours >= WARM] or samples
    last = samples[-1]
    line, done = last.line, {name: last.done.get(name, 0) for name in RATES}
    bad = line["crc_bad"] + line["framing_bad"]
    return {
        "memory": max(s.rss_bytes for s in warm) - warm[0].rss_bytes <= MOST_GROWTH,
        "damaged": done["flips"] <= bad <= 2 * done["flips"],
        "lost": 0 <= line["lost_frames"] - done["lost"] - done["flips"] <= done["flips"],
        "doubled": line["duplicates"] == done["dup"],
        "no restart": line["resets"] == line["out_of_order"] == line["unknown_type"] == 0,
        "clock": all(abs(s.drift_ppm - FAST) < MOST_PPM for s in samples),
        "estimates": bool(np.ptp([s.Fz_N for s in samples]) <= CLEAN_FZ * abs(last.Fz_N)),
    }


def draw(samples: list[Sample], file: Path) -> None:
    """Draw memory, counters, clock and load over simulated time."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    from tirelib.report.style import STYLE

    hours = [s.hours for s in samples]
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 9.0), layout="constrained")
        axes = figure.subplots(4, 1, sharex=True)
        memory = [s.rss_bytes / 2**20 for s in samples]
        axes[0].plot(hours, memory, ".-")
        axes[0].set(title="Memory of the process [MB]", ylim=(0.0, 1.25 * max(memory)))
        for name, key in (("doubled", "dup"), ("lost and damaged", "lost")):
            told = [s.line["duplicates" if key == "dup" else "lost_frames"] for s in samples]
            extra = 0 if key == "dup" else 1
            made = [s.done.get(key, 0) + extra * s.done.get("flips", 0) for s in samples]
            axes[1].plot(hours, np.subtract(told, made), ".-", label=name)
        axes[1].set(
            title="Frames counted beyond those struck (a flip may cost two)", ylim=(-3, None)
        )
        axes[1].legend(loc="upper left")
        axes[2].plot(hours, [s.drift_ppm - FAST for s in samples], ".-")
        axes[2].set(title=f"Clock fit: error of the drift, which is {FAST:g} ppm [ppm]")
        first = samples[0].Fz_N
        axes[3].plot(hours, [s.Fz_N - first for s in samples], ".-")
        axes[3].set(
            title=f"Fz of unflagged turns: median of ten minutes less {first:.3f} N [N]",
            xlabel="simulated time [h]",
        )
        figure.savefig(file, dpi=110)


def run(
    hours: float, every: float, fmu: Path, day: Path, out: Path, console: Console
) -> dict[str, Any]:
    """Soak, and return what is stored."""
    campaign = read_campaign(day)
    straight = [p for p in campaign.plans if p.kind == "free"]
    plan = min(straight, key=lambda p: abs(p.load - np.median([q.load for q in straight])))
    counts, speed = one_turn(campaign.load(plan))
    conditions = Conditions.constant(speed, plan.pressure, 0.0)
    faults = Faults(RATES, seed=2)
    console.print("   h   x real time   MB      turns   damaged   lost  doubled   ppm      Fz N")
    with ExitStack() as stack:
        recorder = Hourly(out, conditions)
        stack.callback(recorder.close)
        wire = Wire(counts, faults, hours, recorder)
        wheels = Wheels.of_one(ProtocolPlan().decoder(), {None: Device()})
        file = stack.enter_context(FmuFile(read_fmu(fmu)))
        model = stack.enter_context(FmuModel(file))
        estimation = Estimation(lambda _: model, conditions, laps=False)
        chain, notes, due = ReplayChain(wire, wheels, estimation), Notes(wheels, faults), every
        while not chain.ended:
            notes.take(chain.poll(Deadline.never()).turns)
            if chain.ended or due <= wire.moment < 3600.0 * hours:
                tell(notes.sample(wire.moment), console)
                store({"hours": hours, "samples": [asdict(s) for s in notes.samples]}, out)
                due += every
        recorder.close()
        return {
            "hours": hours,
            "rate_Hz": 1.0 / (PERIOD * TICK),
            "faults_a_frame": RATES,
            "recorded_bytes": recorder.bytes,
            "last_recording_whole": recorder.readable(),
            "load_average": os.getloadavg(),
            "good": judge(notes.samples),
            "samples": [asdict(s) for s in notes.samples],
        }


def store(result: dict[str, Any], out: Path) -> None:
    """Write what there is so far: a soak may be stopped."""
    (out / "soak.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


def tell(sample: Sample, console: Console) -> None:
    """Print a sample."""
    line = sample.line
    speed = 3600.0 * sample.hours / sample.cpu_s
    console.print(
        f"{sample.hours:6.2f} {speed:8.1f} {sample.rss_bytes / 2**20:9.1f} {sample.turns:10d} "
        f"{line['crc_bad'] + line['framing_bad']:9d} {line['lost_frames']:6d} "
        f"{line['duplicates']:8d} {sample.drift_ppm:7.2f} {sample.Fz_N:9.3f}",
        highlight=False,
    )


def main() -> None:
    """Soak for so many simulated hours, show, write, and fail where something drifts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=24.0, help="simulated; half an hour or more")
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR")
    parser.add_argument("--every", type=float, default=EVERY, metavar="S", help=argparse.SUPPRESS)
    given = parser.parse_args()
    console, out = Console(), given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    for old in out.glob("hour-*.mcap"):
        old.unlink()
    fmu, day = ready_fmu(Steps(console), out, SAMPLES_PER_STEP)
    result = run(given.hours, given.every, fmu, day, out, console)
    store(result, out)
    draw([Sample(**sample) for sample in result["samples"]], out / "soak.png")
    console.print(result["good"])
    console.print(f"open  {os.path.relpath(out / 'soak.png')}")
    sys.exit(0 if all(result["good"].values()) and result["last_recording_whole"] else 1)


if __name__ == "__main__":
    with one_thread():
        main()
