"""Links keep their deadline, give all that came, and come back when the cable does."""

import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import can
import numpy as np
import pytest

from tests.bench.clocks import Clock
from tests.bench.programs import PATIENCE, wait_until
from tests.bench.test_slcan import Keep, keys, some_frames
from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, LinkError, UnpluggedError
from tirebench.links import BACK, LOST, Link, Read
from tirebench.links.can_bus import CanLink, message_of, packed
from tirebench.links.opening import PortPlan
from tirebench.links.pseudo import PseudoTerminal
from tirebench.links.reconnecting import ReconnectingLink
from tirebench.links.serial_port import MUCH, NAP, SerialLink
from tirebench.links.slcan_port import SlcanLink
from tirebench.protocols.slcan import SlcanDecoder, encode
from tirebench.wire.can_batch import FD_LENGTHS, CanBatch, same_kind, unpack
from tirebench.wire.line_counts import LineCounts

CANNOT = {
    "canalystii",
    "etas",
    "gs_usb",
    "iscan",
    "ixxat",
    "neousys",
    "neovi",
    "nican",
    "robotell",
    "usb2can",
}
"""Interfaces of python-can that cannot be told to be silent."""


@pytest.mark.parametrize("interface", sorted(can.VALID_INTERFACES))
def test_a_bus_is_silent_or_refused_unless_transmission_is_asked_for(
    interface: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[dict[str, object]] = []
    monkeypatch.setattr(can, "Bus", lambda **given: asked.append(given))
    words = {
        "listen_only": True,
        "monitor": True,
        "driver_mode": False,
        "operation_mode": "silent",
        "state": can.BusState.PASSIVE,
    }
    software = interface in ("virtual", "udp_multicast", "serial", "socketcan", "socketcand")
    refused = False
    with suppress(DeviceError):
        refused = True
        CanLink(interface, "x")
        refused = False
    if refused:
        assert not asked
        CanLink(interface, "x", options={"acknowledge": 1})
        assert "acknowledge" not in asked[0]
    else:
        assert software or any(asked[0].get(word) == value for word, value in words.items())
    assert refused == (interface in CANNOT)
    CanLink(interface, "x", transmit=True)
    assert not set(words) & set(asked[-1])


@pytest.fixture
def terminal() -> Iterator[PseudoTerminal]:
    port = PseudoTerminal()
    yield port
    port.close()


def fd_frames(count: int) -> CanBatch:
    rng = np.random.default_rng(1)
    return same_kind(
        0x120 + np.arange(count) % 4, rng.integers(0, 256, (count, 64), np.uint8), fd=True
    )


def gathered(link: Link, until: Callable[[bytes], bool]) -> bytes:
    data, end = b"", Deadline.after(PATIENCE)
    while not until(data) and not end.expired:
        read = link.receive(end.sooner(0.2))
        data += read.data if read else b""
    return data


def test_a_deadline_is_kept_where_nothing_comes(terminal: PseudoTerminal) -> None:
    serial = SerialLink(terminal.path)
    bus = CanLink("virtual", "deadline")
    for link in (serial, bus):
        start = time.monotonic()
        read = link.receive(Deadline.after(0.1))
        assert read is not None
        assert read.data == b""
        assert time.monotonic() - start > 0.05  # one that knows no deadline never returns
        link.close()


def test_a_serial_port_is_opened_once(terminal: PseudoTerminal) -> None:
    link = SerialLink(terminal.path)
    with pytest.raises(LinkError, match=r"the port cannot be opened: another program has it open"):
        SerialLink(terminal.path)
    link.close()


def waiting(terminal: PseudoTerminal, link: SerialLink, size: int) -> None:
    terminal.send(bytes(size))
    wait_until(lambda: link._port.in_waiting >= size)


def test_few_bytes_are_waited_for_once_and_many_are_fetched_with_what_waits_behind_them(
    terminal: PseudoTerminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    link, slept = SerialLink(terminal.path, gather=0.3), []

    class Asleep(Clock):
        now = 1000.0

        def sleep(self, seconds: float) -> None:
            slept.append(seconds)
            if len(slept) == 3:
                waiting(terminal, link, 7)
            super().sleep(seconds)

    clock = Asleep()
    for module in ("tirebench.links.serial_port", "tirebench.deadline"):
        monkeypatch.setattr(f"{module}.time", clock)
    for size, more in ((1, 0), (10, 0), (MUCH, 7)):  # nothing was read before the first
        waiting(terminal, link, size)
        read = link.receive(Deadline.after(5.0))
        assert read is not None
        assert read.data == bytes(size + more)
        if size == 10:
            assert len(slept) == 1
    few, many, then = slept
    assert many == NAP
    assert NAP < few <= 0.3
    assert NAP < then <= 0.3  # when no more had come after the nap
    link.close()


def test_a_port_that_goes_away_while_a_batch_is_gathered_loses_nothing_of_it(
    terminal: PseudoTerminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    link = SerialLink(terminal.path, gather=0.3)
    waiting(terminal, link, 1)
    assert link.receive(Deadline.after(5.0)) is not None
    waiting(terminal, link, 10)  # which may sleep
    monkeypatch.setattr("tirebench.links.serial_port.time.sleep", lambda _: terminal.close())
    read = link.receive(Deadline.after(5.0))
    assert read is not None
    assert read.data == bytes(10)
    with pytest.raises(UnpluggedError):
        link.receive(Deadline.after(5.0))


def test_an_adapter_is_opened_to_listen_and_its_lines_are_read(terminal: PseudoTerminal) -> None:
    link = SlcanLink(terminal.path, 1_000_000, 5_000_000)
    assert os.read(terminal._master, 100) == b"\r\rC\rS8\rY5\rM1\rO\r"
    sent = some_frames(300, 2)
    threading.Thread(target=terminal.send, args=(b"\r" + b"".join(encode(sent)),)).start()
    data = gathered(link, lambda d: d.count(b"\r") > 300)
    assert keys(SlcanDecoder(Keep(), LineCounts()).frames_of(data)) == keys(sent)
    link.close()


@pytest.mark.parametrize(
    ("rates", "transmit", "opening"),
    [
        ((500_000, None), False, b"\r\rC\rS6\rL\r"),
        ((500_000, None), True, b"\r\rC\rS6\rO\r"),
        ((500_000, 2_000_000), True, b"\r\rC\rS6\rY2\rM0\rO\r"),
    ],
)
def test_transmission_must_be_asked_for(
    terminal: PseudoTerminal, rates: tuple[int, int | None], transmit: bool, opening: bytes
) -> None:
    link = SlcanLink(terminal.path, *rates, transmit=transmit)
    assert os.read(terminal._master, 100) == opening
    link.close()
    bus = CanLink("virtual", "silent")
    with pytest.raises(LinkError, match=r"opened for listening only"):
        bus.send(fd_frames(1))
    bus.close()


def test_a_rate_that_slcan_does_not_know_is_refused(terminal: PseudoTerminal) -> None:
    with pytest.raises(DeviceError, match=r"bit rate 8000000: slcan supports 2000000, 5000000"):
        SlcanLink(terminal.path, 1_000_000, 8_000_000)


def test_frames_of_a_virtual_bus_arrive_packed_and_in_order() -> None:
    link = PortPlan("can:virtual:order", data_bitrate=2_000_000).open()
    sender = can.Bus(interface="virtual", channel="order", protocol=can.CanProtocol.CAN_FD)
    sent = fd_frames(200)
    for row in range(200):
        sender.send(message_of(sent, row))
    sender.send(can.Message(arbitration_id=1, is_error_frame=True))
    seen: list[CanBatch] = []
    end = Deadline.after(PATIENCE)
    while sum(map(len, seen)) < 200 and not end.expired:
        read = link.receive(end)
        if read is not None and (batch := unpack(read.data)) is not None:
            seen.append(batch)
    np.testing.assert_array_equal(np.concatenate([b.data for b in seen]), sent.data)
    np.testing.assert_array_equal(np.concatenate([b.identifier for b in seen]), sent.identifier)
    sender.shutdown()
    link.close()


@pytest.mark.parametrize("length", FD_LENGTHS.tolist())
def test_a_frame_of_any_length_keeps_its_bytes(length: int) -> None:
    data = bytes(range(1, length + 1))
    sent = can.Message(arbitration_id=0x123, data=data, is_fd=length > 8, is_extended_id=False)
    short = can.Message(arbitration_id=0x124, data=data[:3], is_extended_id=False)
    for others in ([], [short]):
        batch = packed([sent, *others])
        assert bytes(message_of(batch, 0).data) == data
        assert [bytes(message_of(batch, 1).data) for _ in others] == [data[:3] for _ in others]


def serve(server: socket.socket, frames: list[tuple[int, bytes]], heard: threading.Event) -> None:
    """A socketcand server that knows just enough, and then hangs up."""
    connection, _ = server.accept()
    with connection:
        connection.sendall(b"< hi >")
        for answer in (b"< ok >", b"< ok >"):
            connection.recv(200)
            connection.sendall(answer)
        for identifier, data in frames:
            line = f"< frame {identifier:X} 1.000000 {data.hex().upper()} >"
            connection.sendall(line.encode())
        heard.wait(PATIENCE)


def test_a_socketcand_server_is_read_and_its_end_is_told() -> None:
    frames = [(0x120 + i % 4, bytes([i] * 8)) for i in range(40)]
    with socket.create_server(("127.0.0.1", 0)) as server:
        heard = threading.Event()
        thread = threading.Thread(target=serve, args=(server, frames, heard))
        thread.start()
        options = ("host=127.0.0.1", f"port={server.getsockname()[1]}")
        link = PortPlan("can:socketcand:can0", options=options).open()
        seen: list[tuple[int, bytes]] = []
        end = Deadline.after(PATIENCE)
        while len(seen) < 40 and not end.expired:
            read = link.receive(end)
            batch = None if read is None else unpack(read.data)
            if batch is not None:
                seen += [
                    (int(i), d.tobytes())
                    for i, d in zip(batch.identifier, batch.data[:, :8], strict=True)
                ]
        heard.set()
        assert seen == frames
        thread.join()
        with pytest.raises(UnpluggedError, match=r"the bus was lost .*closed the connection"):
            events_of(link, PATIENCE, BACK)
        link.close()


def test_a_missing_can_interface_is_told() -> None:
    """Also by a system that has no sockets for CAN at all."""
    with pytest.raises(LinkError, match=r"can:socketcan:none9: the bus cannot be opened"):
        PortPlan("can:socketcan:none9").open()


@pytest.mark.parametrize(
    ("typed", "message"),
    [
        ("can:nonsense:0", r"interfaces are .*socketcan"),
        ("can:virtual", r"the channel is missing"),
        ("slcan:/dev/none", r"the port cannot be opened"),
        ("/dev/none", r"no such port exists"),
        ("/dev", r"it is a folder"),
        ("/dev/null", r"it is not a serial port"),
        ("COM99", r"no such port exists"),
        ("slcan", r"'slcan' is not a name of a port"),
        ("can", r"'can' is not a name of a port"),
        ("slcan:", r"the serial port is missing; slcan:PORT is needed"),
        ("sclan:/dev/none", r"'sclan' is not a kind of a port"),
    ],
)
def test_a_port_that_is_none_says_so(typed: str, message: str) -> None:
    with pytest.raises((LinkError, DeviceError), match=message):
        PortPlan(typed).open()


@pytest.mark.parametrize(
    ("port", "kind"),
    [
        ("/dev/none", SerialLink),
        ("slcan:/dev/none", SlcanLink),
        ("can:virtual:x", CanLink),
    ],
)
def test_whoever_stands_by_can_load_what_a_port_needs(
    port: str, kind: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    loaded: list[str] = []
    monkeypatch.setattr("tirebench.links.opening.import_module", loaded.append)
    PortPlan(port).load()
    assert loaded == [kind.__module__]


def events_of(link: Link, seconds: float, until: str) -> tuple[list[str], bytes]:
    events, data, end = [], b"", Deadline.after(seconds)
    while not end.expired and until not in events:
        read = link.receive(end.sooner(0.1))
        if read is None:
            break
        events += [read.event] if read.event else []
        data += read.data
    return events, data


def test_a_cable_that_is_plugged_in_again_is_tried_when_its_name_appears(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tirebench.links.reconnecting.FIRST_WAIT", 10.0 * PATIENCE)
    name = tmp_path / "port"
    port = PseudoTerminal(name)
    link = ReconnectingLink(lambda: SerialLink(str(name)), PATIENCE)
    for cycle in range(3):
        port.send(b"before")
        assert gathered(link, lambda d: b"before" in d) == b"before"
        port.close()
        assert events_of(link, PATIENCE, LOST)[0] == [LOST]
        assert events_of(link, 0.15 * cycle, BACK)[0] == []
        port = PseudoTerminal(name)
        assert events_of(link, PATIENCE, BACK)[0] == [BACK]
    link.close()
    port.close()


def test_a_port_that_stays_away_ends_with_its_loss(tmp_path: Path) -> None:
    name = tmp_path / "port"
    port = PseudoTerminal(name)
    link = ReconnectingLink(lambda: SerialLink(str(name)), 0.3)
    port.close()
    with pytest.raises(UnpluggedError, match=r"the port was lost"):
        events_of(link, PATIENCE, BACK)
    link.close()


class Failing:
    """A link that cannot be opened a few times."""

    name, live, encoding = "bus", True, "can"

    def __init__(self, failures: int, clock: Clock) -> None:
        self.left, self.opened, self._clock = failures, [], clock

    def open(self) -> "Failing":
        self.opened.append(self._clock.monotonic())
        if len(self.opened) > 1 and self.left:
            self.left -= 1
            raise LinkError("still away")
        return self

    def receive(self, deadline: Deadline) -> Read | None:
        if len(self.opened) == 1:
            raise UnpluggedError("gone")
        return Read(0, b"x")

    def close(self) -> None:
        pass

    def overruns(self) -> int:
        return 3


def test_attempts_lie_farther_and_farther_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock()
    for module in ("tirebench.links.reconnecting", "tirebench.deadline"):
        monkeypatch.setattr(f"{module}.time", clock)
    failing = Failing(6, clock)
    link = ReconnectingLink(failing.open, 60.0)
    assert events_of(link, 60.0, BACK)[0] == [LOST, BACK]
    # the last waits are the longest that are allowed; each ends with a look 1 ms later at most
    np.testing.assert_allclose(
        np.diff(failing.opened), [0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0], atol=2e-3
    )
    assert link.overruns() == 6
    link.close()


class Leaving(Failing):
    """A link that opens at once, and goes away as soon as it is read, a few times."""

    def open(self) -> "Leaving":
        self.opened.append(self._clock.monotonic())
        return self

    def receive(self, deadline: Deadline) -> Read | None:
        if len(self.opened) <= self.left:
            raise UnpluggedError("gone")
        return Read(0, b"x")


@pytest.mark.parametrize("times", [0, 1, 4])
def test_overruns_of_every_connection_are_counted(
    times: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = Clock()
    for module in ("tirebench.links.reconnecting", "tirebench.deadline"):
        monkeypatch.setattr(f"{module}.time", clock)
    link = ReconnectingLink(Leaving(times, clock).open, 60.0)
    for _ in range(times):
        assert events_of(link, 60.0, BACK)[0] == [LOST, BACK]
    assert link.overruns() == 3 * (1 + times)
    link.close()
