"""RTDE byte by byte as Universal Robots' guide has it; ``benchmarks/fuzz_rtde.py`` sends anything else."""

import struct
from itertools import chain, count, pairwise

import numpy as np
import pytest

from palpate.simulation.emulators.ur import RtdeSession, ToolForce, UrController, UrServer
from palpate.simulation.emulators.ur.controller import CYCLE_NS
from tests.virtual_ur import HOME


def made():
    controller = UrController(HOME, lambda now_ns: (0.0,) * 6)
    return controller, RtdeSession(controller)


def package(kind, payload=b""):
    return struct.pack(">HB", 3 + len(payload), ord(kind)) + payload


HELLO = package("V", b"\x00\x02")


def test_conversation_of_the_guide():
    _, session = made()
    assert session.receive(HELLO) == bytes.fromhex("0004 56 01")
    assert session.receive(package("v")) == bytes.fromhex("0013 76") + struct.pack(">4I", 5, 11, 1, 108318)
    rate = struct.pack(">d", 125.0)
    assert session.receive(package("O", rate + b"actual_q,runtime_state")) == package("O", b"\x01VECTOR6D,UINT32")
    assert session.receive(package("O", rate + b"timestamp,nonsense")) == package("O", b"\x00DOUBLE,NOT_FOUND")
    assert session.due(0) == b""
    assert session.receive(package("S")) == package("S", b"\x01")
    assert session.due(10**9) == package("U", b"\x01" + struct.pack(">6dI", *HOME, 1))
    assert [bool(session.due(10**9 + i * CYCLE_NS)) for i in range(1, 9)].count(True) == 2  # 125 Hz of 500
    assert session.receive(package("P")) == package("P", b"\x01")
    assert session.due(2 * 10**9) == b""
    assert session.receive(package("Z")).startswith(bytes((0, 45, ord("M"))))


def test_input_recipes_number_from_one_and_a_register_has_one_writer():
    controller, session = made()
    names = b"input_int_register_0,input_double_register_3"
    assert session.receive(HELLO + package("I", names))[4:] == package("I", b"\x01INT32,DOUBLE")
    other = RtdeSession(controller)
    assert other.receive(package("I", b"input_int_register_0")) == package("I", b"\x00IN_USE")
    session.receive(package("U", b"\x01" + struct.pack(">id", 11, 2.5)))
    assert controller.inputs["input_int_register_0"] == 11
    assert controller.inputs["input_double_register_3"] == 2.5
    session.close()
    assert other.receive(package("I", b"input_int_register_0")) == package("I", b"\x01INT32")


def test_cycles_that_are_made_up_for_are_as_long_as_others(monkeypatch):
    times_ns = []

    class Recording(UrController):
        def step(self, now_ns):
            times_ns.append(now_ns)
            emulator._end = len(times_ns) == 8

    # Held up for nine cycles once, and then as quick as can be.
    now_ns = chain([0, 0, 0], count(9 * CYCLE_NS, 1000))
    emulator = UrServer(Recording((0.0,) * 6, lambda now_ns: (0.0,) * 6), lambda: next(now_ns))
    monkeypatch.setattr(emulator, "_talk", lambda wait_s: None)
    emulator._serve()
    assert {later - sooner for sooner, later in pairwise(times_ns)} == {CYCLE_NS}


def test_tool_force_is_as_coarse_as_its_data_sheet():
    reading = ToolForce(lambda now_ns: (1.0, 2.0, 3.0, 0.0, 0.0, 0.0), seed=1)
    at_once = np.array([reading(0) for _ in range(2000)])
    assert at_once.std(axis=0) == pytest.approx([1.75] * 3 + [0.1] * 3, rel=0.06)
    assert at_once.mean(axis=0) == pytest.approx([1.0, 2.0, 3.0, 0.0, 0.0, 0.0], abs=0.15)
