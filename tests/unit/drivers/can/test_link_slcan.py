"""A serial CAN adapter that stops taking bytes holds nobody up."""

import os
import pty
import select
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import can
import pytest

from palpate.drivers.can import CanFrame, CanLink, open_bus
from palpate.drivers.can import link as link_module
from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.errors import LateError, SilentError

FILLING = 20_000
"""Frames that no kernel buffer takes."""
REFUSED = 500
"""Frames in a row; were each waited for as long as a first one, they would take 25 s."""


@dataclass
class Cable:
    """A pseudo-terminal in place of the adapter."""

    far: int
    near: int

    @property
    def channel(self) -> str:
        return os.ttyname(self.near)

    def pull(self) -> None:
        os.close(self.far)
        os.close(self.near)
        self.far = self.near = -1


@pytest.fixture
def cable() -> Iterator[Cable]:
    """Nobody reads the far end."""
    ends = Cable(*pty.openpty())
    tty.setraw(ends.near)
    yield ends
    if ends.far >= 0:
        ends.pull()


def require_end(call: Callable[[], object]) -> None:
    """A call comes to its end; it is given time that also a computer has that is held up for seconds."""
    thread = threading.Thread(target=call, daemon=True)
    thread.start()
    thread.join(15.0)
    assert not thread.is_alive(), "hangs"


def until_refused(send: Callable[[], bool]) -> None:
    for _ in range(FILLING):
        if not send():
            return
    raise AssertionError("everything was taken")


def test_frames_that_nobody_takes_are_refused_in_time(cable: Cable) -> None:
    bus = open_bus("slcan", cable.channel, 1_000_000, sleep_after_open=0.0)
    link, frame = CanLink(bus), CanFrame(0x201, bytes(8))
    require_end(lambda: until_refused(lambda: link.send(frame)))
    # A busy kernel makes room again by passing on what it holds; so many in a row are surely refused some day.
    for _ in range(100):
        before = link.send_failures
        # Once it is known, nobody waits 50 ms for it again: a stop has many frames.
        require_end(lambda: [link.send(frame) for _ in range(REFUSED)])
        if link.send_failures == before + REFUSED:
            break
    else:
        raise AssertionError("it went on taking frames")
    require_end(bus.shutdown)
    assert not bus.serialPortOrig.is_open  # type: ignore[attr-defined]


def test_an_adapter_that_takes_bytes_again_is_used_again(cable: Cable) -> None:
    bus = open_bus("slcan", cable.channel, 1_000_000, sleep_after_open=0.0)
    link, frame = CanLink(bus), CanFrame(0x201, bytes(8))
    until_refused(lambda: link.send(frame))
    os.set_blocking(cable.far, False)
    deadline = time.monotonic() + 10.0
    # What was taken before reaches this end a little later.
    while not link.send(frame):
        assert time.monotonic() < deadline
        with suppress(BlockingIOError):
            while True:
                os.read(cable.far, 65536)
    bus.shutdown()


def test_a_frame_that_was_taken_is_not_refused_because_this_program_was_held_up(cable: Cable) -> None:
    bus = open_bus("slcan", cable.channel, 1_000_000, sleep_after_open=0.0)
    # Such a write counts as late as soon as time goes on at all.
    bus.send(can.Message(arbitration_id=0x201, is_extended_id=False, data=bytes(8)), timeout=1e-9)
    bus.shutdown()


def test_an_adapter_that_is_held_up_while_it_is_opened_is_waited_for(
    cable: Cable, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_a_canopen_bus_that_takes_nothing_is_silent_in_time_and_an_emulated_one_is_this_computer_s_fault(
    cable: Cable,
) -> None:
    with CanopenLink.open(interface="slcan", channel=cable.channel, bitrate=1_000_000, sleep_after_open=0.0) as link:

        def send() -> bool:
            try:
                link.send(0x201, bytes(8))
            except SilentError as error:
                raised.append(error)
                return False
            return True

        raised: list[SilentError] = []
        require_end(lambda: until_refused(send))
        assert isinstance(raised[0], LateError)
        assert "palpate emulate --priority" in str(raised[0])
        require_end(link.close)


def test_a_cable_that_is_pulled_ends_the_receive_thread_without_a_traceback(
    cable: Cable, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
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


def test_other_serial_interfaces_do_not_wait_for_ever_either(cable: Cable) -> None:
    bus = open_bus("serial", cable.channel, 1_000_000)

    def send() -> bool:
        try:
            bus.send(can.Message(arbitration_id=0x201, data=bytes(8), is_extended_id=False))
        except can.CanError:
            return False
        return True

    require_end(lambda: until_refused(send))
    bus.shutdown()
