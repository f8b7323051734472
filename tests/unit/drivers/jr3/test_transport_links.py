"""The link: python-can objects that behave, misbehave and vanish."""

import errno
from typing import Any

import can
import pytest
import serial

from palpate.drivers.can.link import MAX_FRAMES, CanFrame, CanLink, FrameKind
from palpate.drivers.errors import SilentError


class ScriptedBus:
    """Gives what is in the script: a message, None, or an exception to raise."""

    def __init__(self, *script: Any) -> None:
        self.script = list(script)
        self.flushed = 0

    def recv(self, timeout: float) -> Any:
        assert timeout == 0.0
        step = self.script.pop(0) if self.script else None
        if isinstance(step, Exception):
            raise step
        return step

    def send(self, message: can.Message) -> None:
        self.recv(0.0)

    def flush(self) -> None:
        self.flushed += 1


def link_to(*script: Any) -> CanLink:
    return CanLink(ScriptedBus(*script))  # type: ignore[arg-type]


def caused(error: Exception, cause: Exception) -> Exception:
    error.__cause__ = cause
    return error


def test_a_virtual_bus() -> None:
    with (
        can.Bus(interface="virtual", channel="jr3-links") as ours,
        can.Bus(interface="virtual", channel="jr3-links") as board,
    ):
        link = CanLink(ours)
        assert link.receive() == []
        assert link.send(CanFrame(0x401))
        heard = board.recv(1.0)
        assert heard is not None
        assert (heard.arbitration_id, heard.dlc, heard.is_extended_id) == (0x401, 0, False)
        board.send(can.Message(arbitration_id=0x601, data=bytes(8), is_extended_id=False))
        board.send(can.Message(arbitration_id=0x601, data=bytes(8), is_extended_id=True))
        board.send(can.Message(arbitration_id=0x601, is_remote_frame=True, dlc=8, is_extended_id=False))
        board.send(can.Message(arbitration_id=0x601, data=bytes(8), is_fd=True, is_extended_id=False))
        kinds = [frame.kind for frame in link.receive()]
        assert kinds == [FrameKind.DATA, FrameKind.EXTENDED, FrameKind.REMOTE, FrameKind.FD]


def test_bus_off_is_counted() -> None:
    link = link_to(can.Message(arbitration_id=0x40, is_error_frame=True, dlc=8, data=bytes(8), is_extended_id=False))
    assert link.receive() == [CanFrame(0x40, bytes(8), FrameKind.ERROR)]
    assert link.bus_offs == 1


@pytest.mark.parametrize("error", [ValueError("bad hex"), IndexError("short line")])
def test_a_malformed_line_does_not_end_the_reception(error: Exception) -> None:
    good = can.Message(arbitration_id=0x701, is_extended_id=False)
    link = link_to(error, error, good)
    assert link.receive() == [CanFrame(0x701)]
    assert link.garbled == 2


def test_a_line_that_is_not_text_is_flushed() -> None:
    poisoned = caused(can.CanOperationError("read"), UnicodeDecodeError("utf-8", b"\xff", 0, 1, "bad"))
    link = link_to(poisoned, can.Message(arbitration_id=0x701, is_extended_id=False))
    assert link.receive() == [CanFrame(0x701)]
    assert link.garbled == 1
    assert link._bus.flushed == 1  # type: ignore[attr-defined]


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
def test_an_interface_that_is_gone(error: Exception) -> None:
    with pytest.raises(SilentError, match="interface fails"):
        link_to(error).receive()


def test_a_full_queue_passes_but_a_dead_interface_does_not() -> None:
    link = link_to(can.CanOperationError("Transmit buffer full"))
    assert not link.send(CanFrame(0x401))
    assert link.send_failures == 1
    with pytest.raises(SilentError):
        link_to(OSError(errno.ENODEV, "gone")).send(CanFrame(0x401))


def test_a_flood_is_taken_in_portions() -> None:
    link = link_to(*[can.Message(arbitration_id=0x701, is_extended_id=False)] * (MAX_FRAMES + 3))
    assert len(link.receive()) == MAX_FRAMES
    assert len(link.receive()) == 3
