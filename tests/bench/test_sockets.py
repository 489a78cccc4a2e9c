"""Lines over the network: TCP servers and UDP datagrams."""

import socket
import threading
from collections.abc import Iterator

import pytest

from tests.bench.programs import PATIENCE
from tests.bench.servers import Server
from tirebench.deadline import Deadline
from tirebench.errors import DeviceError, LinkError, UnpluggedError
from tirebench.links.opening import PortPlan
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
