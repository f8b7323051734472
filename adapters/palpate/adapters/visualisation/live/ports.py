"""Ports of this computer."""

from __future__ import annotations

import socket


def require_free_port(port: int) -> None:
    """Make sure that a server may listen here.

    Raises:
        OSError: Another one does.
    """
    with socket.socket() as tried:
        tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        tried.bind(("127.0.0.1", port))
