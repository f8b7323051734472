"""A CAN bus that is accessed through python-can and polled without a thread.

python-can's receive thread ends silently when a serial CAN adapter sends a malformed line (INFERENCE from its
notifier.py; seen on a pseudo-terminal), so none is used here: each poll calls ``recv``. CANopen needs such a thread;
see :mod:`palpate.drivers.cia402.link`.
"""

import logging
from contextlib import suppress
from typing import Any, Final, NamedTuple

import can
import serial
from can.exceptions import error_check
from can.interfaces.slcan import slcanBus
from typing_extensions import override

from palpate.drivers.errors import SilentError, WiringError
from palpate.drivers.serial_port import WRITE_TIMEOUT_S, close_serial, write_unless_stuck

MAX_FRAMES = 512
"""Maximum number of frames read per call, so that a flooded bus cannot block a control loop."""

_BUS_OFF = 0x40


class CanFrame(NamedTuple):
    """A data frame with an 11-bit identifier and its actual payload length, which an interface may misreport."""

    can_id: int
    data: bytes = b""


# Back ends log the errors that they raise; without a handler, Python also prints them.
logging.getLogger("can").addHandler(logging.NullHandler())

_LIBRARIES: Final = {"kvaser": "CANlib, libcanlib.so or canlib32.dll"}
FRAME_TIMEOUT_S: Final = 0.05
"""Time limit for an adapter to accept a frame; at 115200 baud, a frame takes 2.4 ms (CALC)."""
OPEN_TIMEOUT_S: Final = 1.0
"""Time limit for opening the bus. Nothing moves yet, and a busy computer may be delayed by 50 ms (MEASURED)."""
_STALLED_S: Final = 0.001
"""Time limit after a rejected frame; short because a stop sends many frames. With 0, pyserial loops (FACT)."""


class BoundedSlcanBus(slcanBus):
    """Serial CAN adapter that raises ``can.CanError`` if it does not accept a frame within ``FRAME_TIMEOUT_S``.

    FACT (python-can 4.6.1, ``slcan.py``): ``slcanBus`` sends with no time limit and then drains (``tcdrain``), so an
    adapter that stops accepting bytes blocks its caller forever. Closing the bus first writes to it, so the port stays
    open if this write fails.
    """

    _wait_s = FRAME_TIMEOUT_S

    @override
    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        super().send(msg, self._wait_s if timeout is None else timeout)

    def _write(self, string: str) -> None:
        port = self.serialPortOrig
        with error_check("the serial CAN adapter takes no bytes"):
            if port.write_timeout is None:
                port.write_timeout = OPEN_TIMEOUT_S
            try:
                write_unless_stuck(port, string.encode() + self.LINE_TERMINATOR)
            except serial.SerialTimeoutException:
                self._wait_s = _STALLED_S
                raise
            self._wait_s = FRAME_TIMEOUT_S

    def shutdown(self) -> None:
        """Instruct the adapter to leave the bus if it still responds, and always close the port."""
        can.BusABC.shutdown(self)
        if self.serialPortOrig.is_open:
            with suppress(can.CanError):
                self.close()
            close_serial(self.serialPortOrig)


def open_bus(interface: str, channel: Any, bitrate: int, **options: Any) -> can.BusABC:
    """Open a bus.

    Args:
        interface: Interface name in python-can, such as ``socketcan``, ``slcan`` or ``virtual``.
        bitrate: Bit rate in bit/s. python-can sets it if it can; for socketcan, the operating system sets it.

    Raises:
        WiringError: The bus does not exist, or permission is denied.
    """
    try:
        if interface == "slcan":
            # By default, python-can's slcan sleeps two seconds after opening.
            slcan = BoundedSlcanBus(channel=channel, bitrate=bitrate, **{"sleep_after_open": 0.1} | options)
            slcan.serialPortOrig.exclusive = True
            return slcan
        bus = can.Bus(channel=channel, interface=interface, bitrate=bitrate, **options)
    except Exception as error:  # each back end has its own exceptions, all of which mean that there is no bus
        problem = f"cannot be opened ({error})"
        remedy = "check the adapter, its name, that the interface is up, and that you may open it"
        if isinstance(error, TypeError):
            remedy = "give python-can what this interface needs, and no more, in [arm.can] or [force_sensor.can]"
        elif isinstance(error, NameError):
            # FACT (python-can 4.6.1, kvaser): without the vendor's library, names are undefined in this back end.
            problem = f"cannot be opened: the library of its maker is missing ({_LIBRARIES.get(interface, interface)})"
            remedy = f"install it; python-can's documentation of {interface} says from where"
        raise WiringError(f"CAN bus {interface} {channel}", problem, remedy) from error
    for part in vars(bus).values():
        # Other interfaces over serial ports also write without a time limit.
        if isinstance(part, serial.SerialBase) and part.write_timeout is None:
            part.write_timeout = WRITE_TIMEOUT_S
    return bus


class CanLink:
    """Link that sends and receives frames on a python-can bus. The caller opens and closes the bus.

    Do not set software filters on the bus: ``recv(0)`` returns None for a frame that a filter rejects (FACT, python-can
    bus.py), but None here means that no frame is waiting. On slcan, every call that finds no frame takes the port's
    time-out, 1 ms by default (FACT).

    Attributes:
        garbled: Number of lines that the interface could not decode, plus the number of other kinds of frames.
        send_failures: Number of frames that the interface did not accept, for example because its queue was full.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self.garbled = self.bus_offs = self.send_failures = 0
        self._bus = bus

    def receive(self) -> list[CanFrame]:
        """Return received frames, oldest first.

        Raises:
            SilentError: The interface is gone.
        """
        frames: list[CanFrame] = []
        for _ in range(MAX_FRAMES):
            try:
                message = self._bus.recv(0.0)
            except (ValueError, IndexError):
                self.garbled += 1
                continue
            except can.CanError as error:
                if not isinstance(error.__cause__, (ValueError, IndexError)):
                    raise self._gone(error) from error
                self.garbled += 1
                self._unpoison()
                continue
            except Exception as error:  # pyserial raises TypeError for a closed port; others raise any exception
                raise self._gone(error) from error
            if message is None:
                break
            if message.is_error_frame or message.is_remote_frame or message.is_extended_id or message.is_fd:
                self.garbled += 1
                self.bus_offs += message.is_error_frame and bool(message.arbitration_id & _BUS_OFF)
            else:
                frames.append(CanFrame(message.arbitration_id, bytes(message.data)))
        return frames

    def send(self, frame: CanFrame) -> bool:
        """Send a frame; return False if the interface did not accept it, so that the request's time-out applies.

        Raises:
            SilentError: The interface is gone.
        """
        message = can.Message(arbitration_id=frame.can_id, data=frame.data, is_extended_id=False)
        try:
            self._bus.send(message)
        except can.CanError:
            # A full queue (ENOBUFS) is temporary; if the interface is gone, the next receive fails.
            self.send_failures += 1
            return False
        except Exception as error:  # as above
            raise self._gone(error) from error
        return True

    def _unpoison(self) -> None:
        # python-can's slcan keeps a line that is not UTF-8 and fails on it at every call until it is flushed.
        flush = getattr(self._bus, "flush", None)
        if flush is not None:
            try:
                flush()
            except (can.CanError, OSError, TypeError) as error:
                raise self._gone(error) from error

    def _gone(self, error: Exception) -> SilentError:
        offs = f" after {self.bus_offs} bus-offs" if self.bus_offs else ""
        remedy = "check the adapter's plug, 'ip -details link show' and the bus termination, then connect again"
        return SilentError("JR3 on CAN", f"the CAN interface fails ({error}){offs}", remedy)
