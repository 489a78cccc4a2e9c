"""Where a page is found: its socket and its token."""

import secrets
import socket


def listener(host: str, port: int) -> socket.socket:
    """Bind a page's socket; port 0 takes a free one.

    Raises
    ------
    OSError
        If the address cannot be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    return socket.create_server((host, port), family=family, backlog=64)


def new_token() -> str:
    """Return a token that nobody can guess."""
    return secrets.token_urlsafe(24)
