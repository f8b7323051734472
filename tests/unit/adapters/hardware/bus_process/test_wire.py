"""What lies between loop and arm: messages that never wait, notes that are never half."""

import mmap
import socket

import pytest

from palpate.adapters.hardware.bus_process.wire import _SLOT_BYTES, Board, HostedStatus, Report, Wire
from palpate.core.errors import CommandError, ConfigurationError, DeviceError, FaultLatchedError
from palpate.core.ports.contracts import FakeClock


@pytest.mark.parametrize(
    "error",
    [
        ConfigurationError("arm.nodes", (1, 1), "different ones"),
        CommandError("too many", {1.0}),
        FaultLatchedError("arm", "drive 3: overcurrent"),
    ],
)
def test_an_error_keeps_its_kind_its_text_and_what_can_be_said_of_it(error: Exception) -> None:
    again = Report.of(error, "arm").error()
    assert (type(again), str(again)) == (type(error), str(error))
    assert {name: str(value) for name, value in vars(again).items()} == {n: str(v) for n, v in vars(error).items()}


def test_a_stranger_s_error_becomes_the_device_s() -> None:
    again = Report.of(ZeroDivisionError("by zero"), "arm").error()
    assert isinstance(again, DeviceError)
    assert str(again) == "arm: its adapter failed: ZeroDivisionError('by zero')"


def test_a_line_is_full_or_dead_and_says_so_without_waiting() -> None:
    here, there = (Wire(end, FakeClock()) for end in socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET))
    assert there.take() is None
    while here.put("x" * 1000):
        pass
    assert there.take() == "x" * 1000
    there.close()
    for use in (lambda: here.put(1), here.take):
        with pytest.raises(EOFError):
            use()
    here.close()


def test_the_newest_whole_note_counts() -> None:
    memory = mmap.mmap(-1, Board.BYTES)
    writer, reader = Board(memory), Board(memory)
    assert reader.read() is None
    for time_ns in range(5):
        writer.write(HostedStatus(time_ns, "x" * time_ns * 10_000))
    found = reader.read()
    assert found is not None
    assert (found.time_ns, len(found.fault or "")) == (4, 1000)
    writer.write(HostedStatus(6))
    # As if its writer had been killed in the middle.
    memory[_SLOT_BYTES + 20] ^= 1
    memory[20] ^= 1
    assert reader.read() is found
