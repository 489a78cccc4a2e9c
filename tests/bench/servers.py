"""Receivers in the network: what they send is queued before the run begins."""

import socket
import threading
from collections.abc import Callable, Iterable


class Server:
    """A TCP server that sends pieces to its reader once it may, and then keeps the line open.

    Parameters
    ----------
    pieces : iterable of bytes
    may : callable
        Waits until a piece may be sent, given its number.
    """

    def __init__(self, pieces: Iterable[bytes], may: Callable[[int], object] = int) -> None:
        self._pieces = list(pieces)
        self._may = may
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._line: socket.socket | None = None
        self.url = f"tcp://127.0.0.1:{self._listening.getsockname()[1]}"
        self.sent = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        try:
            self._line, _ = self._listening.accept()
            for number, piece in enumerate(self._pieces):
                self._may(number)
                self._line.sendall(piece)
        except OSError:  # closed before all was sent
            return
        self.sent.set()

    def close(self) -> None:
        for one in (self._line, self._listening):
            if one is not None:
                one.close()
        self._thread.join()
