"""Access to the bus through a ``canopen.Network``, with supervision of its receive thread.

``canopen`` receives in a python-can thread. Three pitfalls were observed with ``canopen`` 2.4.1 and python-can
4.6.1. An exception in a subscriber is only logged. A bus error, such as a malformed line from a serial adapter or an
unplugged adapter, ends the thread without a message; the bus then appears quiet, although sending still works. Every
cycle therefore calls :meth:`CanopenLink.require_alive`.
"""

import contextlib
import logging
from collections.abc import Callable
from typing import Any, Final, Self, TypeAlias

import can
import canopen
from canopen.objectdictionary import ObjectDictionary
from canopen.sdo import SdoClient
from typing_extensions import override

from palpate.drivers.can import open_bus
from palpate.drivers.cia402.codec import SDO_ANSWER, SDO_REQUEST
from palpate.drivers.cia402.objects import Objects
from palpate.drivers.errors import SilentError

Subscriber: TypeAlias = Callable[[int, bytearray, float], None]

# Without a handler, Python prints canopen's log messages about a dead bus for each frame; here they raise an error.
logging.getLogger("canopen").addHandler(logging.NullHandler())

_SDO_BYTES: Final = 8
_NOTIFIER_CYCLE_S: Final = 0.1
"""Period at which the receive thread checks whether to end; closing waits for up to five periods."""


class _EndOfReceiving(can.Listener):
    """Exception that ends the receive thread without a traceback; python-can keeps it for ``require_alive``."""

    @override
    def on_message_received(self, msg: can.Message) -> None: ...

    @override
    def on_error(self, exc: Exception) -> None:
        raise SystemExit


class CanopenLink:
    """A connected ``canopen.Network`` with a readable name; other drivers may add listeners to its notifier."""

    def __init__(self, network: Any, name: str = "CAN bus") -> None:
        self.network = network
        self.name = name

    @classmethod
    def open(
        cls,
        *,
        interface: str,
        channel: Any,
        bitrate: int,
        **options: Any,
    ) -> Self:
        """Connect to a bus; the arguments are the same as for :func:`palpate.drivers.can.open_bus`.

        Raises:
            WiringError: The bus does not exist, or permission is denied.
        """
        network = canopen.Network(open_bus(interface=interface, channel=channel, bitrate=bitrate, **options))
        network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE_S
        network.NOTIFIER_SHUTDOWN_TIMEOUT = 5 * _NOTIFIER_CYCLE_S
        network.listeners.append(_EndOfReceiving())
        network.connect()
        return cls(network, f"CAN bus {interface} {channel}")

    def objects(self, node: int, timeout_s: float) -> Objects:
        """Return an accessor for a node's object dictionary.

        ``canopen``'s node class is not used: its EMCY handler fails on a malformed frame before other subscribers
        receive it, and its drive class falls back to SDO with a warning at each read.
        """
        client = SdoClient(SDO_REQUEST + node, SDO_ANSWER + node, ObjectDictionary())
        client.RESPONSE_TIMEOUT = timeout_s
        client.network = self.network
        client.MAX_RETRIES = 2

        def take(identifier: int, data: bytearray, timestamp: float) -> None:
            # canopen would parse a damaged frame; if the frame is dropped, it repeats the request once.
            if len(data) == _SDO_BYTES:
                client.on_response(identifier, data, timestamp)

        self.network.subscribe(SDO_ANSWER + node, take)
        return Objects(node, client)

    def subscribe(self, identifier: int, subscriber: Subscriber) -> None:
        """Call a function in the receive thread for every frame with this identifier."""
        self.network.subscribe(identifier, subscriber)

    def unsubscribe(self, identifier: int) -> None:
        """End all subscriptions to this identifier, if there are any."""
        if identifier in self.network.subscribers:
            self.network.unsubscribe(identifier)

    def require_alive(self) -> None:
        """Require that the receive thread is running.

        Raises:
            SilentError: The thread has ended, so no frames are received.
        """
        notifier = self.network.notifier
        error = None if notifier is None else notifier.exception
        if notifier is None or notifier.stopped or error is not None:
            cause = "it is closed" if error is None else f"{type(error).__name__}: {error}"
            raise SilentError(self.name, f"receiving has ended ({cause})", "check the adapter, then open the bus again")

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame.

        Raises:
            SilentError: The bus did not accept the frame.
        """
        try:
            self.network.send_message(identifier, data)
        except Exception as error:  # here the package raises the error, of any type, that ended its receive thread
            problem = f"does not take frames: {type(error).__name__}: {error}"
            remedy = "check the adapter; on socketcan a longer txqueuelen helps against full buffers"
            raise SilentError(self.name, problem, remedy) from error

    def close(self) -> None:
        """Release the bus. May be called repeatedly, even after the connection was lost."""
        # Releasing a lost bus raises the earlier error again.
        with contextlib.suppress(Exception):
            self.network.disconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
