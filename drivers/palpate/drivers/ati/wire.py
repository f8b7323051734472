"""Sockets to a Net F/T. Nothing here waits longer than it is told."""

import socket
import time
from typing import Final

from palpate.drivers.errors import SettingError, SilentError, WiringError

_NAME: Final = "ATI Net F/T"
_CHECK: Final = "check the address in [force_sensor], the cable, and that this computer is in the same network"
_MOST_DATAGRAMS: Final = 4096
"""Taken per call: more than a socket's buffer holds, so that a stream of any rate comes to an end."""
_MOST_PAGE: Final = 1 << 16
_DATAGRAM: Final = 2048


class UdpWire:
    """Datagrams from and to one box.

    Raises:
        WiringError: There is no such address.
    """

    def __init__(self, host: str, port: int) -> None:
        self._told = f"{host}, UDP port {port}"
        try:
            family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(family, kind, protocol)
            self._socket.setblocking(False)
            self._socket.connect(address)
        except (OSError, UnicodeError) as error:
            raise WiringError(_NAME, f"{self._told} cannot be reached ({error})", _CHECK) from error

    def send(self, datagram: bytes) -> None:
        """Send a request.

        Raises:
            WiringError: Nobody is there to hear it.
        """
        try:
            self._socket.send(datagram)
        except OSError as error:
            raise WiringError(_NAME, f"{self._told} is not there any more ({error})", _CHECK) from error

    def receive(self) -> list[bytes]:
        """What has arrived.

        Raises:
            WiringError: Nobody is there to send.
        """
        datagrams: list[bytes] = []
        try:
            while len(datagrams) < _MOST_DATAGRAMS:
                datagrams.append(self._socket.recv(_DATAGRAM))
        except BlockingIOError:
            pass
        except OSError as error:
            raise WiringError(_NAME, f"{self._told} is not there any more ({error})", _CHECK) from error
        return datagrams

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


def fetch_page(host: str, port: int, page: str, timeout_s: float) -> bytes:
    """A page of the box's web server.

    Args:
        timeout_s: Longest wait for all of it, however slowly it comes.

    Raises:
        WiringError: Nobody is there.
        SilentError: It did not come in time.
        SettingError: It is no such page.
    """
    told, deadline_ns = f"http://{host}:{port}{page}", time.monotonic_ns() + round(timeout_s * 1e9)
    answer = b""
    try:
        with socket.create_connection((host, port), timeout_s) as line:
            line.sendall(f"GET {page} HTTP/1.0\r\nHost: {host}\r\n\r\n".encode())
            while len(answer) <= _MOST_PAGE:
                left_s = (deadline_ns - time.monotonic_ns()) * 1e-9
                if left_s <= 0.0:
                    raise TimeoutError
                line.settimeout(left_s)
                part = line.recv(_DATAGRAM)
                if not part:
                    break
                answer += part
    except TimeoutError as error:
        raise SilentError(_NAME, f"{told} did not come within {timeout_s:g} s", _CHECK) from error
    except (OSError, UnicodeError) as error:
        raise WiringError(_NAME, f"{told} cannot be fetched ({error})", _CHECK) from error
    head, _, body = answer.partition(b"\r\n\r\n")
    status = head.split(b"\r\n")[0].split()
    if len(status) < 2 or status[1] != b"200" or len(answer) > _MOST_PAGE:
        problem = f"{told} is no page of it: {head[:40].decode('latin-1')!r}"
        raise SettingError(_NAME, problem, "check that this address is a Net F/T's")
    return body
