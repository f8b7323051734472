"""Communication with the modules on a synchronised line, one request at a time, each with a time-out.

Replies carry no address, so a late one must not be mistaken for the reply to the next request. After every failure the
line is flushed, and zeros complete any frame that a module may be waiting for, before anything else is sent. On a busy
computer, data may arrive even later. Therefore the next reply is accepted only after the module has answered another
request with a unique length: a line preserves order, so no older reply can follow.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable
from typing import Final

from palpate.drivers.errors import DriverError, GarbledError, LateError, SilentError, WiringError
from palpate.drivers.nmc.commands import CLEAR_BITS, NOP, read_stat
from palpate.drivers.nmc.frames import EVERYBODY, FRAME_OVERHEAD_BYTES, MAX_DATA_BYTES, Code, NmcCommand, StatusItem
from palpate.drivers.nmc.replies import Discarded, Reply, decode_reply, reply_size_bytes
from palpate.drivers.nmc.settings import ERRORS_IN_A_ROW, POWER_UP_BAUD, BusSettings, SerialTiming
from palpate.drivers.serial_port import ByteStream, write_unless_stuck

DEVICE: Final = "NMC bus"
_RESYNC: Final = bytes(30)
_LONGEST_BYTES: Final = FRAME_OVERHEAD_BYTES + MAX_DATA_BYTES + reply_size_bytes(StatusItem(0xFF))
_POLL_S: Final = 0.0002
_OTHERS: Final = "see whether a second program or controller talks on this bus, or raise [arm] timeout_scale"
_ALL_ITEMS: Final = StatusItem(0xFF)
_QUESTIONS: Final = (
    StatusItem.AUX,
    StatusItem.VELOCITY,
    StatusItem.VELOCITY | StatusItem.AUX,
    StatusItem.HOME,
    StatusItem.HOME | StatusItem.AUX,
    StatusItem.HOME | StatusItem.VELOCITY,
)
"""Requests whose replies have three to eight bytes, each of a different length."""


class NmcBus:
    """An NMC bus; :mod:`palpate.drivers.nmc.startup` starts it up.

    Not thread-safe: only one thread may use it. Any exception from a port means that the port is gone: when an adapter
    is unplugged, pyserial raises ``termios.error`` and ``TypeError`` in addition to ``OSError``.

    Raises:
        SilentError: Raised by any method that communicates if the port is gone.
    """

    def __init__(
        self,
        stream: ByteStream,
        clock_ns: Callable[[], int],
        sleep_s: Callable[[float], None],
        settings: BusSettings,
    ) -> None:
        self.settings = settings
        self._stream, self._clock_ns, self._sleep_s = stream, clock_ns, sleep_s
        self.exchanges = 0
        self.errors: Counter[str] = Counter()
        self._masks: dict[int, StatusItem] = {}
        self._failures: defaultdict[int, int] = defaultdict(int)
        self._run = self._stray_run = 0
        self._is_dirty = True
        self._requested = 0
        self.line = SerialTiming(POWER_UP_BAUD, settings.adapter_latency_s)

    def timeout_s(self, size_bytes: int) -> float:
        """Return the time-out for an exchange with this total number of bytes in both directions."""
        return self.line.exchange_s(size_bytes) + self.settings.slack_s

    def wait_s(self, duration_s: float) -> None:
        """Sleep on the injected clock."""
        self._sleep_s(duration_s)

    def set_line(self, baud: int) -> None:
        """Change the baud rate of the host's port."""
        self.line = SerialTiming(baud, self.settings.adapter_latency_s)
        try:
            self._stream.baudrate = baud
            self._stream.timeout = self.timeout_s(_LONGEST_BYTES)
        except Exception as error:
            raise self._gone(error) from error
        self._is_dirty = True

    def forget(self) -> None:
        """Clear all masks and failure counts, for modules that are new or have been reset."""
        self._masks.clear()
        self.forgive()

    def forgive(self) -> None:
        """Clear the failure counts."""
        self._failures.clear()
        self._run = self._stray_run = 0

    def resync(self) -> None:
        """Flush the line and complete any frame that a module may be waiting for."""
        try:
            self._stream.reset_input_buffer()
            write_unless_stuck(self._stream, _RESYNC)
            # A module may answer the frame that the zeros completed: wait for the reply, then flush it.
            self._sleep_s(self.timeout_s(len(_RESYNC) + reply_size_bytes(_ALL_ITEMS)))
            self._stream.reset_input_buffer()
        except Exception as error:
            raise self._gone(error) from error
        self._is_dirty = False

    def send_raw(self, data: bytes) -> None:
        """Send bytes that get no reply, and wait until they are sent."""
        try:
            write_unless_stuck(self._stream, data)
        except Exception as error:
            raise self._gone(error) from error
        self._sleep_s(self.line.wire_s(len(data)))

    def broadcast(self, addresses: Iterable[int], command: NmcCommand) -> None:
        """Send a command twice to each of these modules without waiting for replies, on a transmit-only line."""
        if self._is_dirty:
            self.resync()
        # The replies to a broadcast belong to no request.
        self._is_dirty = True
        self.send_raw(b"".join(command.frame(address) for address in addresses) * 2)

    def attempt(self, address: int, command: NmcCommand) -> Reply | Discarded:
        """Try an exchange once; failures are counted but not raised."""
        was_dirty = self._is_dirty
        if was_dirty:
            self.resync()
        # The flag stays set if anything, including Ctrl-C, interrupts this exchange.
        self._is_dirty = True
        result = self._converse(address, command)
        # Before its items are set, the module's replies are unknown; start-up checks them itself.
        if was_dirty and isinstance(result, Reply) and address in self._masks:
            if self._waiting_bytes():
                result = Discarded.TOGETHER
            elif not self._is_in_step(address):
                result = Discarded.LATE
        self._note(address, command, result)
        return result

    def _converse(self, address: int, command: NmcCommand) -> Reply | Discarded:
        mask = self._expected(address, command)
        frame, size = command.frame(address), reply_size_bytes(mask)
        sent_ns = self._clock_ns()
        try:
            self._take_stray()
            write_unless_stuck(self._stream, frame)
            raw = self._read(size, sent_ns + round(self.timeout_s(len(frame) + size) * 1e9))
        except Exception as error:
            raise self._gone(error) from error
        result = decode_reply(raw, mask)
        if result in (Discarded.SHORT, Discarded.CHECKSUM) and frame.startswith(raw):
            result = Discarded.ECHO
        return result

    def _is_in_step(self, address: int) -> bool:
        """Return True if the module answers a request whose reply cannot be mistaken for a late reply."""
        usual = reply_size_bytes(self._masks[address])
        questions = [items for items in _QUESTIONS if reply_size_bytes(items) != usual]
        self._requested += 1
        reply = self._converse(address, read_stat(questions[self._requested % len(questions)]))
        return isinstance(reply, Reply) and not self._waiting_bytes()

    def exchange(self, address: int, command: NmcCommand) -> Reply | None:
        """Send a command once, as in each control cycle, and return the reply, or None if it was lost or discarded.

        Raises:
            SilentError: More consecutive replies are missing than the settings allow, or the port is gone.
            GarbledError: Too many consecutive replies are invalid, or bytes arrive without a request.
            WiringError: The line echoes.
        """
        result = self.attempt(address, command)
        allowed = ERRORS_IN_A_ROW
        if self._stray_run >= allowed:
            problem = f"heard bytes without a request before {self._stray_run} requests in a row"
            raise GarbledError(DEVICE, problem, _OTHERS)
        if isinstance(result, Reply):
            return result
        if max(self._failures[address], self._run) >= allowed:
            raise _error(address, result, allowed)
        return None

    def disown(self, address: int) -> None:
        """Reject the last accepted reply as coming from another module, and resynchronise the line."""
        self._is_dirty = True
        self._note(address, NOP, Discarded.ANOTHER)

    def require(self, address: int, command: NmcCommand) -> Reply:
        """Send a command and return the reply; repeat failed exchanges as often as the settings allow.

        Use this only for commands that can safely be executed twice.

        Raises:
            SilentError, GarbledError, WiringError: As for :meth:`exchange`.
        """
        while (reply := self.exchange(address, command)) is None:
            continue
        return reply

    def group(self, command: NmcCommand) -> None:
        """Send a command to all modules at once; none of them answers."""
        if self._is_dirty:
            self.resync()
        self.send_raw(command.frame(EVERYBODY))

    def clear_bits(self, address: int) -> Reply:
        """Clear a module's sticky fault bits; the bus never clears them by itself.

        Raises:
            SilentError, GarbledError, WiringError: As for :meth:`exchange`.
        """
        return self.require(address, CLEAR_BITS)

    def _expected(self, address: int, command: NmcCommand) -> StatusItem:
        if command.code in (Code.DEF_STAT, Code.READ_STAT):
            return StatusItem(command.data[0])
        return self._masks.get(address, StatusItem(0))

    def _waiting_bytes(self) -> int:
        try:
            return self._stream.in_waiting
        except Exception as error:
            raise self._gone(error) from error

    def _take_stray(self) -> None:
        waiting = self._stream.in_waiting
        if not waiting:
            self._stray_run = 0
            return
        stray = self._stream.read(waiting)
        self._stream.reset_input_buffer()
        self.errors["bytes without a request"] += len(stray)
        self._stray_run += 1

    def _read(self, size: int, deadline_ns: int) -> bytes:
        raw = b""
        while len(raw) < size:
            chunk = self._stream.read(size - len(raw))
            raw += chunk
            if len(raw) < size and self._clock_ns() >= deadline_ns:
                break
            if not chunk:
                # Some streams, such as sockets, block for less than the requested time.
                self._sleep_s(_POLL_S)
        return raw

    def _note(self, address: int, command: NmcCommand, result: Reply | Discarded) -> None:
        self.exchanges += 1
        if isinstance(result, Reply):
            self._is_dirty = False
            self._failures[address] = self._run = 0
            if command.code is Code.DEF_STAT:
                self._masks[address] = StatusItem(command.data[0])
            return
        self.errors[f"module {address}: {result.value}"] += 1
        self._failures[address] += 1
        self._run += 1

    def _gone(self, error: Exception) -> SilentError:
        self._is_dirty = True
        return SilentError(DEVICE, f"the port is gone ({error})", "plug the serial adapter in and open the port again")


def _error(address: int, reason: Discarded, times: int) -> DriverError:
    device, problem = f"NMC module {address}", f"{times} failures in a row, the last: {reason.value}"
    if reason is Discarded.ECHO:
        return WiringError(device, problem, "connect both pairs of the full-duplex bus, without loop or local echo")
    if reason in (Discarded.TOGETHER, Discarded.LATE):
        remedy = "end other work on this computer, lower the USB adapter's latency timer, or raise [arm] timeout_scale"
        return LateError(device, problem, remedy)
    if reason is Discarded.MISSING:
        return SilentError(device, problem, "check its supply and cable, and the USB adapter's latency timer")
    return GarbledError(device, problem, "check cable, termination and grounding, or choose a lower baud rate")
