"""A signal in the data bytes of a CAN frame, taken out of whole batches at once. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tirebench.wire.can_batch import ByteArray
from tirebench.wire.frames import IntArray
from tirelib.core.arrays import FloatArray

_ANYBODY = "Vector__XXX"
"""The DBC format's own word where a signal names no receiver."""


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal of a frame.

    Attributes
    ----------
    name : str
    start, length : int
        Bits, as a DBC counts them.
    signed : bool
    factor : float
    unit : str
    big_endian : bool
    offset : float
    comment : str
    real : bool
        A number of IEEE 754 with 32 or 64 bits instead of an integer.
    selector : Signal or None
        Multiplexer: the signal is in the frame only where this one has one of the values...
    selected : tuple of int
        ...that stand here.
    """

    name: str
    start: int
    length: int
    signed: bool = False
    factor: float = 1.0
    unit: str = ""
    big_endian: bool = False
    offset: float = 0.0
    comment: str = ""
    real: bool = False
    selector: "Signal | None" = None
    selected: tuple[int, ...] = ()

    @property
    def line(self) -> str:
        """The signal as a DBC says it."""
        bounds = [f"{self.offset + self.factor * raw:.10g}" for raw in self.bounds]
        return (
            f" SG_ {self.name} : {self.start}|{self.length}@{int(not self.big_endian)}"
            f"{'-' if self.signed else '+'} ({self.factor:.10g},{self.offset:.10g}) "
            f'[{bounds[0]}|{bounds[1]}] "{self.unit}" {_ANYBODY}'
        )

    @property
    def bounds(self) -> tuple[int, int]:
        """Lowest and highest raw value."""
        low = -(1 << (self.length - 1)) if self.signed else 0
        return low, (1 << (self.length - int(self.signed))) - 1

    @property
    def places(self) -> IntArray:
        """Its bits in the frame, least significant first; bit p is bit p % 8 of byte p // 8."""
        if not self.big_endian:
            return np.arange(self.start, self.start + self.length)
        # a DBC counts a big-endian signal from its most significant bit, within bytes downwards
        first = 8 * (self.start // 8) + 7 - self.start % 8
        along = np.arange(first + self.length - 1, first - 1, -1)
        return np.asarray(8 * (along // 8) + 7 - along % 8)


def real_values(data: ByteArray, signals: Sequence[Signal]) -> FloatArray:
    """Return the raw values of signals that are real, shape (m, number of signals).

    Examples
    --------
    >>> data = np.frombuffer(np.array([1.5, -2.0], ">f4").tobytes(), np.uint8)[None, :]
    >>> real_values(data, [Signal("a", 7, 32, real=True, big_endian=True)]).tolist()
    [[1.5]]
    """
    bits = np.unpackbits(data, axis=1, bitorder="little")
    values = np.empty((len(data), len(signals)))
    for column, signal in enumerate(signals):
        packed = np.ascontiguousarray(
            np.packbits(bits[:, signal.places], axis=1, bitorder="little")
        )
        values[:, column] = packed.view("<f4" if signal.length == 32 else "<f8")[:, 0]
    return values


def raw_values(data: ByteArray, signals: Sequence[Signal]) -> IntArray:
    """Return the raw values of signals, shape (m, number of signals); data of shape (m, n).

    Examples
    --------
    >>> data = np.array([[0x12, 0xF4]], np.uint8)
    >>> raw_values(data, [Signal("a", 8, 4), Signal("b", 12, 4, True)]).tolist()
    [[4, -1]]
    """
    bits = np.unpackbits(data, axis=1, bitorder="little")
    values = np.empty((len(data), len(signals)), np.int64)
    for column, signal in enumerate(signals):
        weights = np.int64(1) << np.arange(signal.length, dtype=np.int64)
        if signal.signed:
            weights[-1] = -weights[-1]
        values[:, column] = bits[:, signal.places] @ weights
    return values
