"""The published CAN database, ``tirelib.dbc`` beside this file, made from one table of signals.

RAW16 and RAW12C share an identifier (they never share a bus), and a database holds an identifier
once. So there are two files: `tirelib.dbc` for CAN FD and ``tirelib_classic.dbc`` for classic CAN.
"""

from collections.abc import Iterator
from pathlib import Path

from tirebench.protocols.estimates import ESTIMATE_BASES, estimate_signals
from tirebench.protocols.layouts import (
    BATTERY_STEP,
    HEALTH,
    LAYOUTS,
    PRESSURE_STEP,
    RAW12,
    RAW12C,
    RAW16,
    STEP12,
    SYNC,
)
from tirebench.protocols.signals import Signal
from tirebench.wire.frames import GAGES

PUBLISHED_WHEELS = 4
FOLDER = Path(__file__).parent
FILES = {
    FOLDER / "tirelib.dbc": (RAW16, RAW12, HEALTH),
    FOLDER / "tirelib_classic.dbc": (RAW12C, SYNC, HEALTH),
}
"""Each file and the kinds of frame in it; estimates are in both."""
_FRAME_FORMAT = {False: 0, True: 14}  # VFrameFormat: StandardCAN, StandardCAN_FD


def raw_signals(kind: str) -> tuple[Signal, ...]:
    """Return the signals of a strain frame; counts are those of sixteen bits."""
    samples = LAYOUTS[kind].samples
    if kind == RAW12C:
        # big-endian: the most significant bit of nibble n is bit 7 or 3 of byte n // 2
        starts = [8 * (n // 2) + (7 if n % 2 == 0 else 3) for n in range(1, 16, 3)]
        gages = [
            Signal(f"gage_{g}", start, 12, True, STEP12, big_endian=True)
            for g, start in enumerate(starts, start=1)
        ]
        return (Signal("counter", 7, 4, big_endian=True), *gages)
    bits, factor = (16, 1.0) if kind == RAW16 else (12, float(STEP12))
    counts = [
        Signal(f"gage_{gage + 1}_{sample + 1}", bits * (sample * GAGES + gage), bits, True, factor)
        for sample in range(samples)
        for gage in range(GAGES)
    ]
    return (*counts, Signal("seq", 480, 8), Signal("t_us", 488, 24, unit="us"))


def signals(kind: str) -> tuple[Signal, ...]:
    """Return the signals of a kind of frame, in the order of their bits."""
    if kind == SYNC:
        return (Signal("sample_index", 0, 32), Signal("t_us", 32, 32, unit="us"))
    if kind == HEALTH:
        return (
            Signal("radio_lost", 0, 16, unit="frames"),
            Signal("rssi", 16, 8, True, unit="dBm"),
            Signal("temperature", 24, 8, True, unit="degC"),
            Signal("battery", 32, 8, factor=BATTERY_STEP, unit="V"),
            Signal("pressure", 40, 8, factor=PRESSURE_STEP / 1e5, unit="bar"),
            Signal("flags", 48, 16),
        )
    return raw_signals(kind)


def database(kinds: tuple[str, ...]) -> str:
    """Return a DBC with these kinds of frame and the estimates, for four wheels."""
    frames: list[tuple[int, str, int, bool, tuple[Signal, ...]]] = []
    for wheel in range(PUBLISHED_WHEELS):
        for kind in kinds:
            layout = LAYOUTS[kind]
            frames.append(
                (layout.base + wheel, f"{kind}_{wheel}", layout.length, layout.fd, signals(kind))
            )
        for kind, base in ESTIMATE_BASES.items():
            frames.append((base + wheel, f"{kind}_{wheel}", 8, False, estimate_signals(kind)))
    return "\n".join(_lines(sorted(frames))) + "\n"


def _lines(frames: list[tuple[int, str, int, bool, tuple[Signal, ...]]]) -> Iterator[str]:
    yield 'VERSION "tirelib 1"'
    yield ""
    yield "NS_ :"
    yield ""
    yield "BS_:"
    yield ""
    yield "BU_: WHEEL BENCH"
    for identifier, name, length, _, content in frames:
        sender = "BENCH" if name.startswith("ESTIMATE") else "WHEEL"
        yield ""
        yield f"BO_ {identifier} {name}: {length} {sender}"
        for signal in content:
            yield signal.line
    yield ""
    yield 'CM_ "Wheel transmitter of tirelib; counts become strain by a device file. Wheel n of a'
    yield 'kind has the identifier of wheel 0 plus n, n to 7.";'
    for identifier, _, _, _, content in frames:
        for signal in content:
            if signal.comment:
                yield f'CM_ SG_ {identifier} {signal.name} "{signal.comment}";'
    kinds = [
        "StandardCAN",
        "ExtendedCAN",
        *(f"reserved{n}" for n in range(2, 14)),
        "StandardCAN_FD",
        "ExtendedCAN_FD",
    ]
    yield f'BA_DEF_ BO_ "VFrameFormat" ENUM {",".join(f"{chr(34)}{k}{chr(34)}" for k in kinds)};'
    yield 'BA_DEF_ BO_ "CANFD_BRS" ENUM "0","1";'
    yield 'BA_DEF_ "BusType" STRING ;'
    yield 'BA_DEF_DEF_ "VFrameFormat" "StandardCAN";'
    yield 'BA_DEF_DEF_ "CANFD_BRS" "0";'
    yield 'BA_DEF_DEF_ "BusType" "CAN";'
    if any(fd for _, _, _, fd, _ in frames):
        yield 'BA_ "BusType" "CAN FD";'
    for identifier, _, _, fd, _ in frames:
        yield f'BA_ "VFrameFormat" BO_ {identifier} {_FRAME_FORMAT[fd]};'
        if fd:
            yield f'BA_ "CANFD_BRS" BO_ {identifier} 1;'
