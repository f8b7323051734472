"""CAN interfaces that behave, misbehave and vanish; a serial adapter that stops taking bytes holds nobody up."""

import errno
import os
import pty
import select
import threading
import time
import tty
from contextlib import suppress

import can
import pytest
import serial

from palpate.drivers.can import CanFrame, CanLink, open_bus
from palpate.drivers.can import link as link_module
from palpate.drivers.can.link import MAX_FRAMES
from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.errors import SilentError

FILLING = 20_000
"""Frames that no kernel buffer takes."""
REFUSED = 500
"""Frames in a row; were each waited for as long as a first one, they would take 25 s."""
FRAME = CanFrame(0x201, bytes(8))


class ScriptedBus:
    """Gives what is in the script: a message, None, or an exception to raise."""

    def __init__(self, *script):
        self.script = list(script)
        self.flushed = 0

    def recv(self, timeout):
        assert timeout == 0.0
        step = self.script.pop(0) if self.script else None
        if isinstance(step, Exception):
            raise step
        return step

    def send(self, message):
        self.recv(0.0)

    def flush(self):
        self.flushed += 1


def link_to(*script):
    return CanLink(ScriptedBus(*script))


def caused(error, cause):
    error.__cause__ = cause
    return error


def test_data_frames_come_in_and_go_out_and_others_are_counted():
    with (
        can.Bus(interface="virtual", channel="jr3-links") as ours,
        can.Bus(interface="virtual", channel="jr3-links") as board,
    ):
        link = CanLink(ours)
        assert link.receive() == []
        assert link.send(CanFrame(0x401))
        heard = board.recv(1.0)
        assert (heard.arbitration_id, heard.dlc, heard.is_extended_id) == (0x401, 0, False)
        board.send(can.Message(arbitration_id=0x601, data=bytes(8), is_extended_id=False))
        board.send(can.Message(arbitration_id=0x601, data=bytes(8), is_extended_id=True))
        board.send(can.Message(arbitration_id=0x601, is_remote_frame=True, dlc=8, is_extended_id=False))
        board.send(can.Message(arbitration_id=0x601, data=bytes(8), is_fd=True, is_extended_id=False))
        assert link.receive() == [CanFrame(0x601, bytes(8))]
        assert link.garbled == 3


def test_bus_off_is_counted():
    link = link_to(can.Message(arbitration_id=0x40, is_error_frame=True, dlc=8, data=bytes(8), is_extended_id=False))
    assert link.receive() == []
    assert link.bus_offs == 1


@pytest.mark.parametrize(
    ("error", "flushed"),
    [
        (ValueError("bad hex"), 0),
        (IndexError("short line"), 0),
        (caused(can.CanOperationError("read"), UnicodeDecodeError("utf-8", b"\xff", 0, 1, "bad")), 1),
    ],
)
def test_malformed_line_does_not_end_the_reception(error, flushed):
    link = link_to(error, error, can.Message(arbitration_id=0x701, is_extended_id=False))
    assert link.receive() == [CanFrame(0x701)]
    assert (link.garbled, link._bus.flushed) == (2, 2 * flushed)


@pytest.mark.parametrize(
    "error",
    [
        can.CanOperationError("down", errno.ENETDOWN),
        caused(can.CanOperationError("read"), OSError(errno.EIO, "gone")),
        OSError(errno.ENODEV, "gone"),
        serial.SerialException("gone"),
        TypeError("port closed"),
    ],
)
def test_interface_that_is_gone_is_silent(error):
    with pytest.raises(SilentError, match="interface fails"):
        link_to(error).receive()


def test_full_queue_passes_but_a_dead_interface_does_not():
    link = link_to(can.CanOperationError("Transmit buffer full"))
    assert not link.send(CanFrame(0x401))
    assert link.send_failures == 1
    with pytest.raises(SilentError):
        link_to(OSError(errno.ENODEV, "gone")).send(CanFrame(0x401))


def test_flood_is_taken_in_portions():
    link = link_to(*[can.Message(arbitration_id=0x701, is_extended_id=False)] * (MAX_FRAMES + 3))
    assert [len(link.receive()) for _ in range(2)] == [MAX_FRAMES, 3]


class Cable:
    """A pseudo-terminal in place of the adapter; nobody reads the far end."""

    def __init__(self):
        self.far, self.near = pty.openpty()
        tty.setraw(self.near)
        self.channel = os.ttyname(self.near)

    def drain(self):
        os.set_blocking(self.far, False)
        with suppress(BlockingIOError):
            while True:
                os.read(self.far, 65536)

    def pull(self):
        if self.far >= 0:
            os.close(self.far)
            os.close(self.near)
            self.far = -1


@pytest.fixture
def cable():
    ends = Cable()
    yield ends
    ends.pull()


def require_end(call):
    """A call comes to its end; it is given time that also a computer has that is held up for seconds."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(15.0)
    assert not thread.is_alive(), "hangs"


def until_refused(send):
    for _ in range(FILLING):
        if not send():
            return
    raise AssertionError("everything was taken")


def test_frames_that_no_adapter_takes_are_refused_in_time_until_it_takes_bytes_again(cable):
    bus = open_bus("slcan", cable.channel, 1_000_000, sleep_after_open=0.0)
    link = CanLink(bus)
    require_end(lambda: until_refused(lambda: link.send(FRAME)))
    # A busy kernel makes room again by passing on what it holds; so many in a row are surely refused some day.
    for _ in range(100):
        before = link.send_failures
        # Once it is known, nobody waits 50 ms for it again: a stop has many frames.
        require_end(lambda: [link.send(FRAME) for _ in range(REFUSED)])
        if link.send_failures == before + REFUSED:
            break
    else:
        raise AssertionError("it took frames again and again")
    deadline = time.monotonic() + 10.0
    # What was taken before reaches the far end a little later.
    while not link.send(FRAME):
        assert time.monotonic() < deadline
        cable.drain()
    require_end(bus.shutdown)
    assert not bus.serialPortOrig.is_open


def test_adapter_that_is_held_up_while_it_is_opened_is_waited_for(cable, monkeypatch):
    # Whoever makes room in this test may be held up himself.
    monkeypatch.setattr(link_module, "OPEN_TIMEOUT_S", 20.0 * link_module.OPEN_TIMEOUT_S)
    os.set_blocking(cable.near, False)
    # A kernel that passes on what it holds makes room again for a moment.
    while select.select([], [cable.near], [], 0.05)[1]:
        with suppress(BlockingIOError):
            while True:
                os.write(cable.near, bytes(4096))
    drain = threading.Timer(0.2, lambda: os.read(cable.far, 65536))
    drain.start()
    open_bus("slcan", cable.channel, 1_000_000, sleep_after_open=0.0).shutdown()
    drain.join()


def test_cable_that_is_pulled_ends_the_receive_thread_without_a_traceback(cable, monkeypatch, capfd):
    monkeypatch.setattr(threading, "excepthook", threading.__excepthook__)
    with CanopenLink.open(interface="slcan", channel=cable.channel, bitrate=1_000_000, sleep_after_open=0.0) as link:
        receiver = next(thread for thread in threading.enumerate() if thread.name.startswith("Notifier"))
        cable.pull()
        receiver.join(5.0)
        assert not receiver.is_alive()
        with pytest.raises(SilentError, match="receiving has ended") as error:
            link.require_alive()
        with pytest.raises(SilentError, match="does not take frames"):
            link.send(0x80, b"")
    assert "\n" not in str(error.value)
    assert capfd.readouterr().err == ""


def test_other_serial_interfaces_do_not_wait_for_ever_either(cable):
    bus = open_bus("serial", cable.channel, 1_000_000)
    link = CanLink(bus)
    require_end(lambda: until_refused(lambda: link.send(FRAME)))
    bus.shutdown()
