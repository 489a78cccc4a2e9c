"""Messages of a map and their signals: of a DBC, or listed (CAN frames, binary frames, text lines).

Whatever a message is on the wire, its signals lie in data bytes: those of a CAN frame, those of a
binary frame after its sync word, or the columns of a text line as a `tirebench.protocols.user_line`
packs them. So one map, one check and one decoder do for all.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from tirebench.protocols.checksums import CHECKSUMS, key
from tirebench.protocols.signals import Signal

CAN_KIND, BINARY, TEXT = "can", "binary", "text"
LONGEST_FRAME = 4096
"""A binary frame may have so many bytes, and a text line so many characters."""
_ITEM = re.compile(r"(\d*)([xbBhHiIlLqQfd])")
_KEYS = {
    CAN_KIND: {"name", "id", "extended", "length", "signals"},
    BINARY: {"name", "sync", "struct", "fields", "checksum", "checksum_from", "checksum_order"},
    TEXT: {"name", "starts", "separator", "columns", "checksum"},
}


@dataclass(frozen=True, slots=True)
class Message:
    """A frame and its signals by name.

    Attributes
    ----------
    name : str
    identifier : int
        Identifier of a frame of CAN; else the number of the message in its map.
    extended : bool
    length : int
        Data bytes.
    signals : mapping of name to Signal
    cut : BinaryCut, TextCut or None
        How it stands on a serial line.
    """

    name: str
    identifier: int
    extended: bool
    length: int
    signals: Mapping[str, Signal]
    cut: "BinaryCut | TextCut | None" = None


@dataclass(frozen=True, slots=True)
class BinaryCut:
    """A frame that begins with a sync word: sync, data, checksum.

    Attributes
    ----------
    sync : bytes
    size : int
        Bytes of the data.
    checksum : str
        One of `tirebench.protocols.checksums.CHECKSUMS`, or empty.
    covers_sync : bool
    big : bool
        Whether the checksum's first byte is its highest.
    """

    sync: bytes
    size: int
    checksum: str
    covers_sync: bool
    big: bool

    @property
    def length(self) -> int:
        """Bytes of the frame on the wire."""
        return len(self.sync) + self.size + self.tail

    @property
    def tail(self) -> int:
        """Bytes of the checksum."""
        return CHECKSUMS[self.checksum].size if self.checksum else 0


@dataclass(frozen=True, slots=True)
class TextCut:
    """A line of text: columns, and ``*`` and the checksum's hex digits.

    Attributes
    ----------
    starts : str
        What its first column says; empty: the first column is a value as the others are.
    separator : str
        A blank stands for any number of blanks.
    columns : tuple of Signal
    checksum : str
    """

    starts: str
    separator: str
    columns: tuple[Signal, ...]
    checksum: str

    @property
    def blanks(self) -> str | None:
        """What `str.split` cuts at."""
        return None if self.separator == " " else self.separator


def kind_of(table: Mapping[str, Any]) -> str:
    """Return what a table [[message]] describes."""
    return BINARY if "sync" in table else TEXT if "columns" in table else CAN_KIND


def listed(table: Mapping[str, Any], number: int) -> Message:
    """Return the message of a table.

    Raises
    ------
    KeyError, TypeError, ValueError, AttributeError, struct.error
        If it describes none.
    """
    kind = kind_of(table)
    if unknown := sorted(set(table) - _KEYS[kind]):
        raise ValueError(
            f"unknown key {', '.join(unknown)}; allowed keys are {', '.join(sorted(_KEYS[kind]))}"
        )
    if kind == BINARY:
        return _binary(table, number)
    return _text(table, number) if kind == TEXT else _can(table)


def of_dbc(database: Any) -> dict[str, Message]:
    """Return the messages of a database of cantools."""
    messages = {}
    for m in database.messages:
        signals = {
            s.name: Signal(
                s.name,
                s.start,
                s.length,
                s.is_signed,
                float(s.scale),
                s.unit or "",
                s.byte_order == "big_endian",
                float(s.offset),
                real=s.is_float,
            )
            for s in m.signals
        }
        ways = {
            s.name: (s.multiplexer_signal, tuple(s.multiplexer_ids))
            for s in m.signals
            if s.multiplexer_ids and s.multiplexer_signal
        }
        messages[m.name] = Message(
            m.name, m.frame_id, m.is_extended_frame, m.length, _multiplexed(signals, ways)
        )
    return messages


def _can(table: Mapping[str, Any]) -> Message:
    signals = {s["name"]: _signal(s) for s in table["signals"]}
    ways = {
        s["name"]: (s["multiplexer"], (int(s["page"]),))
        for s in table["signals"]
        if "multiplexer" in s
    }
    return Message(
        str(table["name"]),
        int(table["id"]),
        bool(table.get("extended", False)),
        int(table["length"]),
        _multiplexed(signals, ways),
    )


def _binary(table: Mapping[str, Any], number: int) -> Message:
    sync, layout = bytes.fromhex(table["sync"]), str(table["struct"])
    if not sync or layout[:1] not in "<>" or not layout:
        raise ValueError("sync must be hex digits, and struct must begin with < or >")
    items = [c for count, c in _ITEM.findall(layout[1:]) for c in c * int(count or 1)]
    size = struct.calcsize(layout)
    if struct.calcsize("<" + "".join(items)) != size or size > LONGEST_FRAME:
        raise ValueError("struct may use x b B h H i I l L q Q f d and describe up to 4096 bytes")
    big, signals, place = layout[0] == ">", [], 0
    fields = list(table["fields"])
    for item in items:
        width = struct.calcsize("<" + item)
        if item != "x":
            start = 8 * place + (7 if big else 0)
            given = _named(fields.pop(0))
            signals.append(
                Signal(
                    str(given["name"]),
                    start,
                    8 * width,
                    item.islower(),
                    float(given.get("factor", 1.0)),
                    "",
                    big,
                    float(given.get("offset", 0.0)),
                    real=item in "fd",
                )
            )
        place += width
    if fields:
        raise ValueError(f"struct has {len(signals)} values, but fields has more names")
    start, order = table.get("checksum_from", "sync"), table.get("checksum_order")
    if start not in ("sync", "fields") or order not in (None, "little", "big"):
        raise ValueError("checksum_from must be sync or fields, checksum_order little or big")
    cut = BinaryCut(
        sync,
        size,
        _checksum(table),
        start == "sync",
        (order or "") == "big" or (order is None and big),
    )
    named = {signal.name: signal for signal in signals}
    return Message(str(table["name"]), number, False, size, named, cut)


def _text(table: Mapping[str, Any], number: int) -> Message:
    place, signals = 0, []
    for entry in table["columns"]:
        given = _named(entry)
        bits = int(given.get("bits", 0))
        if not 0 <= bits <= 32:
            raise ValueError("bits must be 1 .. 32")
        signals.append(
            Signal(
                str(given["name"]),
                place,
                bits or 64,
                bool(given.get("signed", False)),
                float(given.get("factor", 1.0)),
                "",
                False,
                float(given.get("offset", 0.0)),
                real=not bits,
            )
        )
        place += 64
    separator, starts = str(table.get("separator", ",")), str(table.get("starts", ""))
    if len(separator) != 1 or not separator.isascii() or not starts.isascii() or not signals:
        raise ValueError(
            "separator must be one ASCII character, starts must be ASCII, and "
            "columns must hold at least one name"
        )
    cut = TextCut(starts, separator, tuple(signals), _checksum(table))
    named = {signal.name: signal for signal in signals if signal.name}
    return Message(str(table["name"]), number, False, place // 8, named, cut)


def _checksum(table: Mapping[str, Any]) -> str:
    given = str(table.get("checksum", ""))
    name = key(given)
    if given and name not in CHECKSUMS:
        raise ValueError(
            f"checksum = {given!r} is unknown; SUM-8, SUM-16, XOR-8 and the CRC names of G. Cook's "
            "catalogue are known, such as CRC-32 and CRC-16/MODBUS"
        )
    return name


def _named(entry: Any) -> Mapping[str, Any]:
    """Return a field or column as a table; its name alone will do."""
    return entry if isinstance(entry, dict) else {"name": str(entry)}


def _multiplexed(
    signals: Mapping[str, Signal], ways: Mapping[str, tuple[str | None, tuple[int, ...]]]
) -> dict[str, Signal]:
    """Return the signals with their multiplexers: its name and its values."""
    plain = {
        name: replace(signal, selector=signals[str(ways[name][0])], selected=ways[name][1])
        if name in ways
        else signal
        for name, signal in signals.items()
    }
    return {
        name: replace(signal, selector=plain[signal.selector.name])
        if signal.selector is not None
        else signal
        for name, signal in plain.items()
    }


def _signal(table: Mapping[str, Any]) -> Signal:
    order = table.get("order", "little")
    if order not in ("little", "big"):
        raise ValueError(f"order = {order!r}; little or big is allowed")
    return Signal(
        str(table["name"]),
        int(table["start"]),
        int(table["length"]),
        bool(table.get("signed", False)),
        float(table.get("factor", 1.0)),
        "",
        order == "big",
        float(table.get("offset", 0.0)),
        real=bool(table.get("float", False)),
    )
