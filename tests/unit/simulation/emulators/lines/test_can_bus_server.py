"""Emulated nodes behind python-can's virtual interface and behind its slcan interface."""

import struct
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager
from uuid import uuid4

import can
import pytest

from tests.unit.simulation.emulators.lines.turned import Turned, jr3, turned_slcan, turned_virtual, wire_of
from tests.virtual_can import VirtualBusServer

interfaces = pytest.mark.parametrize("serve", [turned_virtual, turned_slcan])
Serve = Callable[..., AbstractContextManager[Turned]]


@interfaces
def test_several_nodes_boot_answer_and_stream(serve: Serve) -> None:
    with serve(jr3(1), jr3(2)) as host:
        host.expect(0x701)
        host.expect(0x702)
        host.send(0x482)
        assert host.expect(0x102) == b"\x00" + struct.pack("<3H", 115, 111, 185)
        host.send(0x201, struct.pack("<HI", 0, 5_000))
        assert host.expect(0x101) == b"\x00"
        forces, moments = host.expect(0x601), host.expect(0x681)
        assert forces[6:] == moments[6:]
        assert struct.unpack("<3h", forces[:6]) == (-16384, 16384, 16384)


@interfaces
def test_nodes_can_be_acted_on_while_they_run(serve: Serve) -> None:
    node = jr3()
    with serve(node) as host:
        host.expect(0x701)
        host.server.post(node.reboot)
        host.expect(0x701)

        def hush(_: int) -> None:
            node.firmware.silent = True

        host.server.post(hush)
        host.turn()
        host.send(0x401)
        assert host.receive() is None


@interfaces
def test_remote_and_extended_frames_reach_no_node(serve: Serve) -> None:
    with serve(jr3()) as host:
        host.expect(0x701)
        host.bus.send(can.Message(arbitration_id=0x401, is_extended_id=True))
        host.bus.send(can.Message(arbitration_id=0x401, is_extended_id=False, is_remote_frame=True))
        assert host.receive() is None


def test_a_thread_of_its_own_serves_until_it_is_closed() -> None:
    before, channel = threading.active_count(), f"jr3-{uuid4()}"
    with can.Bus(interface="virtual", channel=channel) as bus:
        with VirtualBusServer(wire_of(jr3()), channel) as server:
            assert threading.active_count() == before + 1
            done: list[int] = []
            server.do(done.append)
            assert len(done) == 1
            message = bus.recv(10.0)
            assert message is not None
            assert message.arbitration_id == 0x701
        assert threading.active_count() == before
        server.close()
        with pytest.raises(TimeoutError, match="did not respond"):
            server.do(lambda _: None, timeout_s=0.01)
