"""``tirebench emulate``: a rig record behind a pseudo-terminal, as a plugged-in wheel."""

import time
from collections.abc import Sequence
from pathlib import Path

import click

from bench.cli.stop import on_stop
from bench.conditions import Conditions, conditions_document
from bench.deadline import Deadline
from bench.device import Device, read_device
from bench.emulator import Script, Tally, play, write_script
from bench.errors import DeviceError, UnpluggedError
from bench.faults import Faults, parse_faults
from bench.links.pseudo import PseudoTerminal
from tirelib.campaign import Campaign, Run, read_campaign
from tirelib.cli.common import FILE, write_json

LINGER = 10.0
"""After the end, the reader gets this long to close the port, [s]."""

_EXAMPLE = """\b
Example:
  tirebench emulate --campaign build/out/set1 --run 3 --run 7 --port-file port --conditions c.json
  tirebench run --port $(cat port) --conditions c.json --fmu StrainTire.fmu --silence 1

\b
It prints the port and waits until a reader opens it. --fault NAME[=VALUE], several allowed: flips,
cuts, inserts, lost, dup (rate per frame), nan (rate per sample), saturate, dead (number of a gage).
Exit code: 0 all was played to a reader, 1 nobody listened to some of it.
"""


@click.command(epilog=_EXAMPLE)
@click.option("--campaign", "folder", metavar="DIR", required=True,
              type=click.Path(path_type=Path), help="A campaign with strain.")  # fmt: skip
@click.option("--run", "numbers", metavar="N", type=int, multiple=True,
              help="Run to play, several in the order given.  [default: the first]")  # fmt: skip
@click.option("--all", "everything", is_flag=True, help="Play all runs.")
@click.option("--device", "device_file", metavar="D.toml", type=FILE, help="Scale and zero.")
@click.option("--wheel", default=0, show_default=True, type=click.IntRange(0, 255))
@click.option("--port-file", metavar="F", type=FILE, help="Write the port's path into this file.")
@click.option("--conditions", "sidecar", metavar="F.json", type=FILE,
              help="Write speed, pressure, camber and the rig's truth.")  # fmt: skip
@click.option("--loop", is_flag=True, help="Begin again at the end, until Ctrl-C.")
@click.option("--speedup", default=1.0, show_default=True, type=click.FloatRange(0.01, 1000.0),
              help="Faster than real time.")  # fmt: skip
@click.option("--fault", "fault_texts", metavar="NAME[=VALUE]", multiple=True,
              help="See below.")  # fmt: skip
@click.option("--seed", default=0, show_default=True, help="Of the faults.")
@click.option("--wait", "patience", default=60.0, show_default=True, metavar="S",
              help="How long to wait for a reader.")  # fmt: skip
@click.option("--unplug", metavar="S", type=float,
              help="Pull the cable after this time.")  # fmt: skip
@click.option("--json", "json_file", metavar="FILE", type=FILE, help="Write what was sent.")
@click.pass_context
def emulate(
    context: click.Context,
    folder: Path,
    numbers: tuple[int, ...],
    everything: bool,
    device_file: Path | None,
    wheel: int,
    port_file: Path | None,
    sidecar: Path | None,
    loop: bool,
    speedup: float,
    fault_texts: tuple[str, ...],
    seed: int,
    patience: float,
    unplug: float | None,
    json_file: Path | None,
) -> None:
    """Play runs of a campaign as SERIAL v1 frames, at their pace, with faults on request."""
    faults = Faults(parse_faults(fault_texts), seed)
    device = Device() if device_file is None else read_device(device_file)
    campaign = read_campaign(folder)
    device.check_layout(campaign.header.gage_lateral, str(folder))
    runs = _runs(campaign, numbers, everything)
    script = write_script(runs, device, faults, wheel=wheel)
    port, tally = PseudoTerminal(), Tally()
    try:
        if sidecar is not None:
            write_json(sidecar, _sidecar(script, loop))
        click.echo(port.path)
        if port_file is not None:
            _announce(port_file, port.path)
        with on_stop(_interrupt):
            port.wait_for_reader(Deadline.after(patience))
            cable = _Cable(port, unplug)
            start, turn = time.monotonic(), 0
            while True:
                play(script, cable, tally, start=start, speedup=speedup)
                turn += 1
                if not loop:
                    break
                script = write_script(runs, device, faults, wheel=wheel, turn=turn)
            port.drain(Deadline.after(LINGER))
            port.wait_for_leave(Deadline.after(LINGER))
    except (KeyboardInterrupt, UnpluggedError) as error:
        click.echo(str(error) or "stopped", err=True)
    finally:
        port.close()
    click.echo(f"{tally.sent} frames in {len(runs)} runs, {tally.unheard} of them unheard, "
               f"at most {1e3 * tally.late:.1f} ms late")  # fmt: skip
    for name, count in faults.done.items():
        click.echo(f"  {count:6d} {name}")
    if json_file is not None:
        write_json(json_file, {
            "format": "tirebench-emulation/1", "runs": [run.plan.run for run in runs],
            "frames": tally.sent, "unheard": tally.unheard, "late_s": tally.late,
            "faults": dict(faults.done),
        })  # fmt: skip
    context.exit(1 if tally.unheard else 0)


def _interrupt() -> None:
    raise KeyboardInterrupt


def _runs(campaign: Campaign, numbers: Sequence[int], everything: bool) -> list[Run]:
    plans = {plan.run: plan for plan in campaign.plans}
    chosen = list(plans) if everything else list(numbers) or list(plans)[:1]
    unknown = [str(number) for number in chosen if number not in plans]
    if unknown or not chosen:
        raise DeviceError(
            f"{campaign.path}: run {', '.join(unknown) or 'none'}; its runs are "
            f"{', '.join(str(number) for number in plans) or 'none'}; choose among them"
        )
    return [campaign.load(plans[number]) for number in chosen]


def _sidecar(script: Script, loop: bool) -> dict[str, object]:
    known = script.conditions
    length = round(1e6 * script.duration) if loop else 0
    return conditions_document(Conditions(known.t_us, known.values, known.runs, length))


def _announce(port_file: Path, path: str) -> None:
    """Write the port's path in one go, so that whoever waits for the file reads all of it."""
    port_file.parent.mkdir(parents=True, exist_ok=True)
    part = port_file.with_name(port_file.name + ".part")
    part.write_text(path + "\n", encoding="utf-8")
    part.replace(port_file)


class _Cable:
    """A port whose cable is pulled at a moment; whatever is sent then is unheard."""

    def __init__(self, port: PseudoTerminal, unplug: float | None) -> None:
        self._port = port
        self._end = Deadline.never() if unplug is None else Deadline.after(unplug)

    def send(self, data: bytes) -> bool:
        if self._end.expired:
            self._port.close()
            raise UnpluggedError(f"{self._port.path}: the cable was pulled, as asked for")
        return self._port.send(data)
