"""Lines over the network: TCP servers and UDP datagrams."""

import socket
import threading
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from tests.bench.programs import PATIENCE
from tests.bench.servers import Server
from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, LinkError, UnpluggedError
from tirebench.links import socket_port
from tirebench.links.opening import PortPlan
from tirebench.links.serial_port import GATHER
from tirebench.links.slcan_port import commands
from tirebench.links.socket_port import SocketLink


def received(link: SocketLink, size: int) -> bytes:
    data, end = b"", Deadline.after(PATIENCE)
    while len(data) < size:
        assert not end.expired
        read = link.receive(Deadline.after(1.0))
        assert read is not None
        data += read.data
    return data


@pytest.fixture
def udp() -> Iterator[SocketLink]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        number = probe.getsockname()[1]
    link = SocketLink(f"udp://127.0.0.1:{number}")
    yield link
    link.close()


def test_a_tcp_server_is_a_port_until_it_hangs_up() -> None:
    server = Server([b"some ", b"bytes"])
    link = PortPlan(server.url).open()
    assert isinstance(link, SocketLink)
    assert received(link, 10) == b"some bytes"
    server.close()
    with pytest.raises(UnpluggedError, match="the connection was lost"):
        received(link, 1)
    link.close()


def test_datagrams_are_read_as_they_come(udp: SocketLink) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for part in (b"one", b"two", b"three"):
            sender.sendto(part, udp._socket.getsockname())
    assert received(udp, 11) == b"onetwothree"


def test_an_empty_datagram_ends_nothing(udp: SocketLink) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for part in (b"", b"more"):
            sender.sendto(part, udp._socket.getsockname())
    assert received(udp, 4) == b"more"


def test_what_a_server_sent_before_it_hung_up_is_not_lost() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        link = SocketLink(f"tcp://127.0.0.1:{listening.getsockname()[1]}")
        line, _ = listening.accept()
        line.sendall(b"last words")
        line.close()
    assert received(link, 10) == b"last words"
    with pytest.raises(UnpluggedError):
        received(link, 1)
    link.close()


def test_reads_are_as_far_apart_as_bytes_are_gathered(
    udp: SocketLink, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[float] = []
    clock = SimpleNamespace(sleep=waits.append, monotonic=lambda: 5.0, monotonic_ns=int)
    monkeypatch.setattr(socket_port, "time", clock)  # no time goes by
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"one", udp._socket.getsockname())
        assert received(udp, 3) == b"one"
        sender.sendto(b"two", udp._socket.getsockname())
        assert received(udp, 3) == b"two"
    assert waits[0] == 0.0
    assert 0.0 < waits[-1] <= GATHER


def test_an_adapter_behind_a_server_is_opened_with_both_bit_rates() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        number = listening.getsockname()[1]
        plan = PortPlan(f"slcan:tcp://127.0.0.1:{number}", bitrate=250_000, data_bitrate=2_000_000)
        link = plan.open()
        line, _ = listening.accept()
        wanted = commands(250_000, 2_000_000, transmit=False)
        link.close()  # the end of what is read
        with line:
            assert line.recv(2 * len(wanted), socket.MSG_WAITALL) == wanted


def test_an_adapter_that_takes_no_command_leaves_no_open_port(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    closed: list[SocketLink] = []

    def refuse(link: SocketLink, _: bytes) -> None:
        raise UnpluggedError(link.name)

    monkeypatch.setattr(SocketLink, "send", refuse)
    monkeypatch.setattr(SocketLink, "close", lambda link: closed.append(link))
    with socket.create_server(("127.0.0.1", 0)) as listening, pytest.raises(UnpluggedError):
        PortPlan(f"slcan:tcp://127.0.0.1:{listening.getsockname()[1]}").open()
    (link,) = closed
    link._socket.close()


def test_an_address_in_use_or_nobody_there_is_told(udp: SocketLink) -> None:
    number = udp._socket.getsockname()[1]
    with pytest.raises(LinkError, match="a free address of this host is needed"):
        SocketLink(f"udp://127.0.0.1:{number}")
    with socket.create_server(("127.0.0.1", 0)) as gone:
        closed = gone.getsockname()[1]
    with pytest.raises(LinkError, match="a server that listens at this address is needed"):
        PortPlan(f"socket://127.0.0.1:{closed}").open()
    with pytest.raises(LinkError, match="cannot be opened"):
        PortPlan(f"rfc2217://127.0.0.1:{closed}").open()


@pytest.mark.parametrize(
    "url", ["tcp://", "tcp://host", "tcp://:5", "udp://h:x", "udp://h:70000", "tcp://h:1/path"]
)
def test_a_wrong_address_says_how_it_is_written(url: str) -> None:
    with pytest.raises(DeviceError, match=r"not a valid address; tcp://HOST:PORT or udp://"):
        PortPlan(url).check()


def test_a_server_that_sends_nothing_holds_nobody_up() -> None:
    may = threading.Event()
    server = Server([b"late"], lambda _: may.wait())
    link = SocketLink(server.url)
    read = link.receive(Deadline.after(0.05))
    assert read is not None
    assert read.data == b""
    may.set()
    assert received(link, 4) == b"late"
    link.close()
    server.close()
