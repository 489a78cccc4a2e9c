"""Several sources in one run, from a file (``tirebench-setup/1``).

::

    format = "tirebench-setup/1"

    [[source]]
    port   = "/dev/ttyUSB0"       # as --port takes it
    baud   = 2000000
    wheel  = 0                    # number that its only wheel gets; left out: as sent
    device = "front_left.toml"    # beside this file

    [[source]]
    port    = "can:socketcan:can0"
    bitrate = 500000
    map     = "vehicle.toml"      # [speed], [pressure], ..., [[wheel]]; beside this file

What a table leaves out is as the options of the command say.
"""

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from tirebench.errors import DeviceError, cause
from tirebench.links.opening import PortPlan
from tirebench.protocols.map_parts import clashes
from tirebench.setup.source_plan import SourcePlan, protocol_of
from tirebench.wire.conditions import Conditions
from tirebench.wire.device import read_device

FORMAT = "tirebench-setup/1"
_KEYS: dict[str, type | tuple[type, ...]] = {
    "port": str,
    "baud": int,
    "bitrate": int,
    "data_bitrate": int,
    "bus_options": list,
    "rate_hz": (int, float),
    "map": str,
    "device": str,
    "wheel": int,
}


def read_setup(path: Path, usual: SourcePlan) -> tuple[SourcePlan, ...]:
    """Read a setup.

    Parameters
    ----------
    path : Path
    usual : SourcePlan
        What holds where a table says nothing.

    Raises
    ------
    DeviceError
        With every fault of the file, and of the maps and device files that it names.
    """
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise DeviceError(
            f"{path}: cannot be read ({cause(error)}); a setup is TOML in UTF-8; check the path "
            "and the file"
        ) from None
    if document.get("format") != FORMAT:
        raise DeviceError(
            f"{path}: format = {document.get('format')!r}; this program reads {FORMAT!r}; correct "
            "it, or use the version of tirelib that wrote the file"
        )
    tables = document.get("source")
    faults = [
        f"{path}: unknown key {key}; allowed keys are format and [[source]]; correct it"
        for key in sorted(set(document) - {"format", "source"})
    ]
    if not isinstance(tables, list) or not tables or not all(isinstance(t, dict) for t in tables):
        faults.append(
            f"{path}: source = {tables!r}; at least one table [[source]] is needed; write it"
        )
        raise DeviceError(faults)
    for number, table in enumerate(tables, start=1):
        faults += _faults(table, f"{path}: source {number}")
    if faults:
        raise DeviceError(faults)
    sources = []
    for number, table in enumerate(tables, start=1):
        try:
            sources.append(_source(table, path.parent, usual))
        except DeviceError as error:
            faults += [f"{path}: source {number}: {problem}" for problem in error.problems]
    if faults:
        raise DeviceError(faults)
    return tuple(sources)


def _faults(table: dict[str, Any], where: str) -> list[str]:
    """Return what is wrong with the keys of a table."""
    faults = [
        f"{where}: unknown key {key}; allowed keys are {', '.join(_KEYS)}; correct it"
        for key in sorted(set(table) - set(_KEYS))
    ]
    if "port" not in table:
        faults.append(
            f"{where}: port is missing; each source needs a port, in the form of --port; add it"
        )
    for key, kind in _KEYS.items():
        value = table.get(key)
        if value is not None and (not isinstance(value, kind) or isinstance(value, bool)):
            wanted = kind.__name__ if isinstance(kind, type) else "number"
            faults.append(
                f"{where}: {key} = {value!r}; a TOML value of type {wanted} is needed; correct it"
            )
    wheel = table.get("wheel", 0)
    if isinstance(wheel, int) and not 0 <= wheel <= 255:
        faults.append(f"{where}: wheel = {wheel}; 0 .. 255 is allowed; correct it")
    return faults


def _source(table: dict[str, Any], folder: Path, usual: SourcePlan) -> SourcePlan:
    port = PortPlan(
        table["port"],
        table.get("baud", usual.port.baud),
        table.get("bitrate", usual.port.bitrate),
        table.get("data_bitrate", usual.port.data_bitrate),
        tuple(map(str, table.get("bus_options", usual.port.options))),
    )
    map_file = folder / table["map"] if "map" in table else None
    protocol = protocol_of(port, float(table.get("rate_hz", usual.protocol.rate)), map_file)
    source = replace(usual, port=port, protocol=protocol, wheel=table.get("wheel"))
    if "device" not in table:
        return source
    file = folder / table["device"]
    device = read_device(file)
    return replace(source, devices={None: device}, device_text=file.read_text(encoding="utf-8"))


def check_sources(sources: Sequence[SourcePlan], conditions: Conditions | None) -> None:
    """Refuse sources that contradict each other, or the options.

    Raises
    ------
    DeviceError
        If two sources have the same port or wheel or send the same condition, or an option gives it
        too.
    """
    faults = []
    ports = [source.port.port for source in sources]
    for port in sorted({port for port in ports if ports.count(port) > 1}):
        faults.append(f"--port {port}: given twice; each source needs its own port; leave one out")
    wheels = [(wheel, source.port.port) for source in sources for wheel in source.known_wheels]
    for wheel in sorted({w for w, _ in wheels}):
        named = [port for w, port in wheels if w == wheel]
        if len(named) > 1:
            faults.append(
                f"wheel {wheel} comes from {' and '.join(named)}; each wheel may come from one "
                "source only; give each source its wheel number with `wheel = N` or --port N=PORT"
            )
    conditions_sent = [
        (place, source.port.port) for source in sources for place in source.conditions_sent
    ]
    places = [place for place, _ in conditions_sent]
    if clash := [(place, port) for place, port in conditions_sent if clashes(place, places)]:
        names = ", ".join(f"{_words(place)} from {port}" for place, port in clash)
        faults.append(
            f"two sources send the same condition: {names}; each condition may come from one "
            "source, for one wheel or for all; remove it from one map"
        )
    known = () if conditions is None else conditions.known
    for place, port in conditions_sent:
        if (name := place[0]) in known:
            faults.append(
                f"{_words(place)} comes from {port}, and from --{name} or --conditions; only one "
                "of them may set it; leave one out"
            )
    if faults:
        raise DeviceError(faults)


def _words(place: tuple[str, int | None]) -> str:
    name, wheel = place
    return name if wheel is None else f"{name} of wheel {wheel}"
