"""The way to the bus: one ``canopen.Network``, and what has to be known about its receive thread.

``canopen`` receives in a thread of python-can. Three traps, each measured with ``canopen`` 2.4.1 and python-can 4.6.1:
an exception in a subscriber is logged and nothing else; an error of the bus (a malformed line of a serial
adapter, an unplugged one) ends the thread without a word, and from then on the bus merely seems quiet; sending
goes on working meanwhile. Hence :meth:`CanopenLink.require_alive` in every cycle.
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

# Without a handler Python prints what canopen logs of a dead bus, at each frame; we raise it as an error.
logging.getLogger("canopen").addHandler(logging.NullHandler())

_NOTIFIER_CYCLE_S: Final = 0.1
"""How often the receive thread looks up; closing waits for it five times as long at most."""


class _EndOfReceiving(can.Listener):
    """Ends the receiving thread at an error, which python-can keeps for :meth:`CanopenLink.require_alive`.

    Without a listener like this one the thread would print a traceback besides.
    """

    @override
    def on_message_received(self, msg: can.Message) -> None: ...

    @override
    def on_error(self, exc: Exception) -> None:
        raise SystemExit


class CanopenLink:
    """A connected bus.

    Args:
        network: A connected ``canopen.Network``; other drivers may hang their listeners on its notifier.
        name: The bus, as a person would call it.
    """

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
        """Connect to a bus.

        Args:
            interface: As :func:`palpate.drivers.can.open_bus`, like the next two and the options.

        Raises:
            WiringError: There is no such bus, or no permission.
        """
        network = canopen.Network(open_bus(interface=interface, channel=channel, bitrate=bitrate, **options))
        network.NOTIFIER_CYCLE = _NOTIFIER_CYCLE_S
        network.NOTIFIER_SHUTDOWN_TIMEOUT = 5 * _NOTIFIER_CYCLE_S
        network.listeners.append(_EndOfReceiving())
        network.connect()
        return cls(network, f"CAN bus {interface} {channel}")

    def objects(self, node: int, timeout_s: float) -> Objects:
        """Return the SDO access to one node.

        ``canopen``'s own node class is left out: its EMCY handler fails on a malformed frame before any other
        subscriber sees it, and its drive class falls back to SDO, with a warning at each read.
        """
        client = SdoClient(SDO_REQUEST + node, SDO_ANSWER + node, ObjectDictionary())
        client.RESPONSE_TIMEOUT = timeout_s
        client.network = self.network
        self.network.subscribe(SDO_ANSWER + node, client.on_response)
        return Objects(node, client)

    def subscribe(self, identifier: int, subscriber: Subscriber) -> None:
        """Have a function called, in the receive thread, with every frame of that identifier."""
        self.network.subscribe(identifier, subscriber)

    def unsubscribe(self, identifier: int) -> None:
        """End all subscriptions to that identifier, if there are any."""
        if identifier in self.network.subscribers:
            self.network.unsubscribe(identifier)

    def require_alive(self) -> None:
        """Find out whether the receive thread still runs.

        Raises:
            SilentError: It does not: nothing that comes is heard.
        """
        notifier = self.network.notifier
        error = None if notifier is None else notifier.exception
        if notifier is None or notifier.stopped or error is not None:
            cause = "it is closed" if error is None else f"{type(error).__name__}: {error}"
            raise SilentError(self.name, f"receiving has ended ({cause})", "check the adapter, then open the bus again")

    def send(self, identifier: int, data: bytes) -> None:
        """Put one frame on the bus.

        Raises:
            SilentError: The bus did not take it.
        """
        try:
            self.network.send_message(identifier, data)
        except Exception as error:  # the package raises here whatever ended its receive thread, of any type
            problem = f"does not take frames: {type(error).__name__}: {error}"
            remedy = "check the adapter; on socketcan a longer txqueuelen helps against full buffers"
            raise SilentError(self.name, problem, remedy) from error

    def close(self) -> None:
        """Release the bus. May be called repeatedly, also after the bus is gone."""
        # A bus that is gone answers its release with the error that was raised before.
        with contextlib.suppress(Exception):
            self.network.disconnect()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
