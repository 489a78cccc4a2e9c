"""A transmitter of another make: a map of its signals (``tirebench-map/1``), no code.

::

    format  = "tirebench-map/1"
    dbc     = "wheel.dbc"         # beside this file; or [[message]] tables, see below
    rate_hz = 2000                # of the gages
    strain_unit = "ustrain"       # of the signals; left out: counts, a device file says the rest

    [[wheel]]
    wheel     = 0
    message   = "WHEEL_FL"
    samples   = [["g1", "g2", "g3", "g4", "g5"]]   # oldest first; gages as in the calibration
    counter   = "count"           # counts messages; this, or time, or both
    time      = "stamp"           # device time of the first sample
    time_unit = "us"              # of the signal's value

    [speed]                       # optional: a condition that the bus sends
    message = "ABS"
    signal  = "v_ref"
    unit    = "km/h"
    hold_s  = 1.0                 # optional: unknown when the bus is silent about it for so long

    [[pressure]]                  # of one wheel; also camber, omega, temperature
    wheel   = 0
    message = "TPMS"
    signal  = "p_fl"
    unit    = "bar"

    [[message]]                   # without a DBC
    name = "WHEEL_FL"
    id   = 0x210                  # extended = true for 29 bits
    length = 8
    signals = [{ name = "g1", start = 4, length = 12, signed = true, order = "little" }, ...]
    # a real number: float = true; multiplexed: multiplexer = "page", page = 1

    [[message]]                   # on a serial line: a sync word, a struct, a checksum
    name     = "WHEEL"
    sync     = "AA55"
    struct   = "<HI5h"            # of Python's struct
    fields   = ["count", "stamp", "g1", "g2", "g3", "g4", "g5"]
    checksum = "CRC-16/MODBUS"

    [[message]]                   # on a serial line: columns of text
    name    = "WHEEL"
    columns = [{ name = "count", bits = 16 }, "g1", "g2", "g3", "g4", "g5"]
"""

import math
import struct
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tirebench.errors import DeviceError, cause
from tirebench.protocols.map_messages import Message, kind_of, listed, of_dbc
from tirebench.protocols.map_parts import CarriedQuantity, UserMap, WheelMap, clashes
from tirebench.protocols.map_signals import SignalLookup, is_wheel
from tirebench.wire.conditions import HOLD, TELLABLE
from tirebench.wire.device import Device
from tirebench.wire.frames import MOST_GAGES
from tirelib.core.errors import TirelibError
from tirelib.core.units import to_si

FORMAT = "tirebench-map/1"
SHORTEST_WRAP = 0.1
"""A counter that wraps sooner needs a time beside it, or a gap could not be seen, [s]."""
_WANTED = (
    "the keys name, id, length and signals (CAN), or name, sync, struct and fields "
    "(binary), or name and columns (text)"
)
_KEYS = {"format", "dbc", "rate_hz", "strain_unit", "wheel", "message", "name", *TELLABLE}
_WHEEL_KEYS = {"wheel", "message", "samples", "counter", "time", "time_unit"}
_CONDITION_KEYS = {"message", "signal", "unit", "wheel", "hold_s"}


def read_map(path: Path) -> UserMap:
    """Read a map and its DBC.

    Raises
    ------
    DeviceError
        With every fault of the file.
    """
    file = path
    try:
        text = path.read_text(encoding="utf-8")
        document = tomllib.loads(text)
        dbc = ""
        if "dbc" in document:
            file = path.parent / str(document["dbc"])
            dbc = file.read_text(encoding="cp1252")
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise DeviceError(
            f"{file}: cannot be read ({cause(error)}); a map is TOML in UTF-8, with its DBC in the "
            "same folder; check the path and the file"
        ) from None
    return parse_map(text, dbc, str(path))


def parse_map(text: str, dbc: str, where: str) -> UserMap:
    """Return what the texts of a map and its DBC say; errors as `read_map`."""
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise DeviceError(
            f"{where}: the map is not valid TOML ({error}); a map is a TOML file; correct that line"
        ) from None
    if document.get("format") != FORMAT:
        raise DeviceError(
            f"{where}: format = {document.get('format')!r}; this program reads {FORMAT!r}; correct "
            "it, or use the version of tirelib that wrote the file"
        )
    return _Reader(document, where).read(text if not dbc else f"{text}\0{dbc}", dbc)


class _Reader(SignalLookup):
    """Reads a map."""

    def __init__(self, document: dict[str, Any], where: str) -> None:
        super().__init__(document, where)
        self.known_keys("", document, _KEYS)

    def read(self, text: str, dbc: str) -> UserMap:
        messages = self._of_dbc(dbc) if dbc else self._of_tables()
        tables = self._tables("wheel")
        rate = self.document.get("rate_hz", None if tables else 1e3)
        if not isinstance(rate, int | float) or isinstance(rate, bool) or not 153 <= rate <= 2e5:
            self.fault("rate_hz", rate, "a rate of 153 .. 200000 Hz is needed")
            rate = 1e3
        wheels = [w for table in tables if (w := self._wheel(table, messages, float(rate)))]
        sent = [name for name in TELLABLE if name in self.document]
        if not tables and not sent:
            self.fault(
                "wheel",
                tables,
                "a table [[wheel]], or one of a condition such as [speed], is needed",
                "write it",
            )
        if len({w.wheel for w in wheels}) < len(wheels):
            self.fault("wheel", [w.wheel for w in wheels], "each wheel number may occur once")
        device = self._device(wheels)
        quantities = [q for name in sent for q in self._quantities(name, messages)]
        places = [(TELLABLE[q.name][0], q.wheel) for q in quantities]
        if twice := {place for place in places if clashes(place, places)}:
            self.fault(
                "conditions",
                sorted(twice, key=str),
                "each condition may occur once per wheel, or once for all wheels",
            )
        if self.faults:
            raise DeviceError(self.faults)
        return UserMap(
            float(rate), tuple(wheels), device, tuple(quantities), text, tuple(messages.values())
        )

    def _tables(self, key: str) -> list[dict[str, Any]]:
        """Return the tables of that name; whatever else has it is a fault."""
        given = self.document.get(key, [])
        found = [one for one in given if isinstance(one, dict)] if isinstance(given, list) else []
        if not isinstance(given, list) or len(found) < len(given):
            self.fault(key, given, f"tables [[{key}]] are needed")
        return found

    def _of_dbc(self, dbc: str) -> dict[str, Message]:
        import cantools  # late: it takes a while, and few need it

        try:
            database: Any = cantools.database.load_string(dbc, "dbc")
        except Exception as error:  # cantools raises its own, textparser's and bare ones
            self.fault("dbc", str(error)[:200], "a valid DBC is needed")
            return {}
        return of_dbc(database)

    def _of_tables(self) -> dict[str, Message]:
        messages: dict[str, Message] = {}
        tables = self._tables("message")
        for number, table in enumerate(tables):
            try:
                message = listed(table, number)
            except (KeyError, TypeError, ValueError, AttributeError, IndexError, struct.error) as e:
                self.fault("message", table, f"{_WANTED} are needed ({_why(e)})")
                continue
            if message.name in messages:
                self.fault("message", message.name, "each name may occur once")
            messages[message.name] = message
        if len({kind_of(table) for table in tables}) > 1:
            self.fault(
                "message",
                [t.get("name") for t in tables],
                "one line carries one kind of message: all are CAN frames, or all have a sync, or "
                "all have columns",
            )
        return messages

    def _wheel(
        self, table: dict[str, Any], messages: Mapping[str, Message], rate: float
    ) -> WheelMap | None:
        before = len(self.faults)
        what = f"wheel {table.get('wheel')!r}"
        self.known_keys(f"{what}: ", table, _WHEEL_KEYS)
        message = self.message(f"{what}: message", table.get("message"), messages)
        rows = table.get("samples", [])
        if (
            not isinstance(rows, list)
            or not rows
            or not all(isinstance(r, list) and len(r) == len(rows[0]) for r in rows)
            or not 1 <= len(rows[0]) <= MOST_GAGES
        ):
            self.fault(
                f"{what}: samples",
                rows,
                f"one list per sample is needed, each of the same 1 to {MOST_GAGES} signals",
            )
            return None
        if message is None:
            return None
        names = [name for row in rows for name in row if name != ""]
        strain = [self.signal(what, name, message) for name in names]
        absent = tuple(name == "" for name in rows[0])
        if any(tuple(name == "" for name in row) != absent for row in rows) or all(absent):
            self.fault(
                f"{what}: samples",
                rows,
                'each sample needs the same gages, at least one; "" stands for a missing gage',
            )
        counter = self.optional(what, table, "counter", message)
        time = self.optional(what, table, "time", message)
        tick = 1.0
        if time is not None:
            tick = self.seconds(what, table.get("time_unit"), time)
            self.integer(what, time)
        elif counter is None:
            self.fault(
                what,
                sorted(table),
                "a counter or time signal is needed, because lost frames could not be detected "
                "without one",
                "name one",
            )
        elif (wrap := 2**counter.length * len(rows) / rate) < SHORTEST_WRAP:
            self.fault(
                f"{what}: counter",
                counter.name,
                f"it wraps after {1e3 * wrap:.0f} ms; without a time signal at least "
                f"{1e3 * SHORTEST_WRAP:.0f} ms are needed, or a gap could not be detected",
                "name a time signal too",
            )
        if counter is not None:
            self.integer(what, counter)
        used = [s for s in (*strain, counter, time) if s is not None]
        if len({(s.selector, s.selected) for s in used}) > 1:
            self.fault(
                f"{what}: samples",
                [s.name for s in used],
                "all signals of a wheel, counter and time included, must be in the same frames: "
                "the same multiplexer with the same value",
            )
        number = table.get("wheel")
        if not is_wheel(number):
            self.fault("wheel", number, "0 .. 255 is needed")
        if len(self.faults) > before:
            return None
        known = tuple(signal for signal in strain if signal is not None)
        return WheelMap(int(number or 0), message, known, counter, time, tick, absent)

    def _device(self, wheels: list[WheelMap]) -> Device:
        """Scale, zero and ends of the range, from the signals."""
        strain = [signal for wheel in wheels for signal in wheel.strain]
        kinds = {(s.length, s.signed, s.factor, s.real) for s in strain}
        if len(kinds) > 1:
            self.fault(
                "samples", sorted(kinds), "all gages must have the same length, sign and factor"
            )
        if len(kinds) != 1:
            return Device()
        low: float
        high: float
        low, high = (-math.inf, math.inf) if strain[0].real else strain[0].bounds
        unit = self.document.get("strain_unit")
        if unit is None and strain[0].real:
            self.fault("strain_unit", unit, "strain that is sent as float needs its unit")
            return Device()
        if unit is None:
            return Device(lowest=low, highest=high)
        try:
            step = strain[0].factor * float(to_si(1.0, str(unit), "strain"))
        except TirelibError as error:
            self.fault("strain_unit", unit, f"a unit of strain is needed ({error})")
            return Device()
        offsets = iter(wheels[0].strain)
        there = (None if absent else next(offsets) for absent in wheels[0].absent)
        zero = tuple(0.0 if s is None else -s.offset / s.factor for s in there)
        return Device("map", step, zero, lowest=low, highest=high)

    def _quantities(self, name: str, messages: Mapping[str, Message]) -> list[CarriedQuantity]:
        given = self.document[name]
        tables = given if isinstance(given, list) else [given]
        if not all(isinstance(table, dict) for table in tables):
            self.fault(
                name, given, f"a table [{name}], or one table [[{name}]] per wheel, is needed"
            )
            return []
        found = [self._quantity(name, table, messages) for table in tables]
        return [quantity for quantity in found if quantity is not None]

    def _quantity(
        self, name: str, table: dict[str, Any], messages: Mapping[str, Message]
    ) -> CarriedQuantity | None:
        self.known_keys(f"{name}: ", table, _CONDITION_KEYS)
        message = self.message(f"{name}: message", table.get("message"), messages)
        if message is None:
            return None
        signal = self.signal(name, table.get("signal"), message)
        hold = table.get("hold_s", HOLD.get(TELLABLE[name][0], math.inf))
        if not isinstance(hold, int | float) or isinstance(hold, bool) or not hold > 0.0:
            self.fault(f"{name}: hold_s", hold, "a time above 0 s is needed")
        unit, wheel = str(table.get("unit")), table.get("wheel")
        dimension = TELLABLE[name][1]
        try:
            to_si(1.0, unit, dimension)
        except TirelibError as error:
            self.fault(f"{name}: unit", unit, f"a unit of {dimension} is needed ({error})")
        if wheel is not None and not is_wheel(wheel):
            self.fault(
                f"{name}: wheel",
                wheel,
                "0 .. 255 is needed; leave it out if the value holds for all wheels",
            )
        return None if signal is None else CarriedQuantity(name, message, signal, unit, wheel, hold)


def _why(error: Exception) -> str:
    """Return what an error says, and a missing key as one."""
    return f"{error.args[0]} is missing" if isinstance(error, KeyError) else str(error)
