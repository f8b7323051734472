import threading
import time

import can
import pytest

from palpate.drivers.cia402.link import CanopenLink
from palpate.drivers.errors import DeviceFaultError, SilentError, WiringError

BUS = {"interface": "virtual", "bitrate": 1_000_000}


def wait_for(condition: object) -> None:
    end = time.monotonic() + 5.0
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end
        time.sleep(0.001)


def test_frames_go_out_and_come_in() -> None:
    heard: list[tuple[int, bytes]] = []
    receivers: list[str] = []

    def told() -> None:
        receivers.append(threading.current_thread().name)

    with (
        CanopenLink.open(channel="link-frames", in_receiver=told, **BUS) as link,  # type: ignore[arg-type]
        can.Bus(interface="virtual", channel="link-frames") as peer,
    ):
        link.subscribe(0x181, lambda can_id, data, _: heard.append((can_id, bytes(data))))
        link.send(0x201, b"\x0f\x00")
        message = peer.recv(1.0)
        assert message is not None
        assert (message.arbitration_id, bytes(message.data), message.is_extended_id) == (0x201, b"\x0f\x00", False)
        for number in (1, 2):
            peer.send(can.Message(arbitration_id=0x181, data=b"\x01", is_extended_id=False))
            wait_for(lambda number=number: len(heard) == number)
        link.unsubscribe(0x181)
        link.unsubscribe(0x181)
        link.require_alive()
    assert heard == [(0x181, b"\x01")] * 2
    # The receive thread is told once that it is one.
    assert len(receivers) == 1
    assert receivers[0] != threading.main_thread().name


def test_a_bus_that_does_not_exist() -> None:
    with pytest.raises(WiringError, match="slcan /dev/no-such-adapter"):
        CanopenLink.open(interface="slcan", channel="/dev/no-such-adapter", bitrate=1_000_000)
    with pytest.raises(WiringError, match="no-such-interface"):
        CanopenLink.open(interface="no-such-interface", channel="can0", bitrate=1_000_000)


def test_a_closed_bus_is_not_alive_and_takes_nothing() -> None:
    link = CanopenLink.open(channel="link-closed", **BUS)  # type: ignore[arg-type]
    link.close()
    link.close()
    with pytest.raises(SilentError):
        link.require_alive()
    with pytest.raises(SilentError):
        link.send(0x80, b"")


def test_the_death_of_the_receive_thread_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    with CanopenLink.open(channel="link-death", **BUS) as link:  # type: ignore[arg-type]

        def fail(_timeout: float) -> None:
            raise ValueError("malformed line")

        monkeypatch.setattr(link.network.bus, "recv", fail)
        wait_for(lambda: link.network.notifier.exception is not None)
        with pytest.raises(SilentError, match="ValueError: malformed line"):
            link.require_alive()
        with pytest.raises(SilentError, match="malformed line"):
            link.send(0x80, b"")


def test_a_failing_subscriber_does_not_end_receiving() -> None:
    heard: list[int] = []

    def fail(_can_id: int, _data: bytearray, _time: float) -> None:
        heard.append(1)
        raise ValueError("bug")

    with (
        CanopenLink.open(channel="link-subscriber", **BUS) as link,  # type: ignore[arg-type]
        can.Bus(interface="virtual", channel="link-subscriber") as peer,
    ):
        link.subscribe(0x181, fail)
        for _ in range(2):
            peer.send(can.Message(arbitration_id=0x181, is_extended_id=False))
        wait_for(lambda: len(heard) == 2)
        link.require_alive()


def test_sdo_errors_are_ours() -> None:
    with (
        CanopenLink.open(channel="link-sdo", **BUS) as link,  # type: ignore[arg-type]
        can.Bus(interface="virtual", channel="link-sdo") as peer,
    ):
        objects = link.objects(5, 0.02)
        with pytest.raises(SilentError, match="drive 5: does not answer about object 0x1018:01"):
            objects.read(0x1018, 1)
        patient = link.objects(6, 2.0)

        def answer_with(code: int) -> None:
            data = b"\x80\x18\x10\x01" + code.to_bytes(4, "little")
            peer.send(can.Message(arbitration_id=0x586, data=data, is_extended_id=False))

        with can.Notifier(peer, [_OnRequest(0x606, answer_with, [0x06020000, 0x08000022, 0x06090011])]):
            assert patient.read(0x1018, 1) is None
            with pytest.raises(DeviceFaultError, match=r"refuses object 0x1018:01.*0x08000022"):
                patient.write(0x1018, 1, 0, 4)
            with pytest.raises(DeviceFaultError, match="has no object 0x1018:01"):
                patient.write(0x1018, 1, 0, 4)


class _OnRequest(can.Listener):
    def __init__(self, identifier: int, answer: object, codes: list[int]) -> None:
        self._identifier, self._answer, self._codes = identifier, answer, codes

    def on_message_received(self, msg: can.Message) -> None:
        if msg.arbitration_id == self._identifier:
            self._answer(self._codes.pop(0))  # type: ignore[operator]

    def stop(self) -> None: ...
