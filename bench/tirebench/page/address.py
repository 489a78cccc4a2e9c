"""Where the page is found: its socket and its token."""

import secrets
import socket

from tirebench.errors import LinkError


def listener(host: str, port: int) -> socket.socket:
    """Bind the page's socket; port 0 takes a free one.

    Raises
    ------
    LinkError
        If the address cannot be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=64)
    except OSError as error:
        raise LinkError(
            f"--host {host} --page-port {port}: the page cannot be bound ({error.strerror}); an "
            "address and a free port of this machine are needed; choose others (port 0 for any "
            "free one), or --no-page"
        ) from None


def new_token() -> str:
    """Return a token that nobody can guess."""
    return secrets.token_urlsafe(24)
