"""Checksums by name: sums, and the CRCs of G. Cook's catalogue, https://reveng.sourceforge.io."""

import zlib
from binascii import crc_hqx
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, NamedTuple

from crccheck import crc


class Checksum(NamedTuple):
    """One kind.

    Attributes
    ----------
    size : int
        Bytes.
    of : callable
        From bytes to the number.
    """

    size: int
    of: Callable[[bytes], int]


def _xor(data: bytes) -> int:
    total = 0
    for byte in data:
        total ^= byte
    return total


def _sum(data: bytes, *, size: int) -> int:
    return sum(data) % (1 << 8 * size)


def _crc(data: bytes, *, kind: Any) -> int:
    return int(kind.calc(data))


def key(name: str) -> str:
    """Return a name as it stands in `CHECKSUMS`.

    Examples
    --------
    >>> key("CRC-16/MODBUS")
    'crc16modbus'
    """
    return "".join(letter for letter in name.lower() if letter.isalnum())


def _hqx(data: bytes, *, start: int) -> int:
    return int(crc_hqx(data, start))


def _known() -> dict[str, Checksum]:
    known = {
        "xor8": Checksum(1, _xor),
        "sum8": Checksum(1, partial(_sum, size=1)),
        "sum16": Checksum(2, partial(_sum, size=2)),
    }
    in_c: dict[Any, Callable[[bytes], int]] = {
        crc.Crc32: zlib.crc32,
        crc.Crc16Xmodem: partial(_hqx, start=0),
        crc.Crc16Ibm3740: partial(_hqx, start=0xFFFF),
    }
    everything: dict[str, Any] = vars(crc)  # other names of a kind included
    for name, kind in everything.items():
        if kind in crc.ALLCRCCLASSES and kind.width() in (8, 16, 32):
            of = in_c.get(kind, partial(_crc, kind=kind))
            known[key(name)] = Checksum(kind.width() // 8, of)
    return known


CHECKSUMS: Mapping[str, Checksum] = _known()
"""Checksums of whole bytes, up to four. Those of the library cost 2.5 us a byte; CRC-32,
CRC-16/XMODEM and CRC-16/CCITT-FALSE, which Python has in C, a hundredth."""
