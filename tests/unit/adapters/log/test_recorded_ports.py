"""The decorators pass everything through, errors too, and tell the recorder of it."""

from __future__ import annotations

import pytest

from palpate.core.errors import CommandError, DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CommandReason, JointCommand
from tests.unit.adapters.log.recording_bench import Bench, ticks_of


def test_nothing_is_told_while_no_log_is_open() -> None:
    bench = Bench()
    bench.run(20)
    bench.ports.arm.stop()
    assert bench.sink.logs == []  # type: ignore[attr-defined]
    bench.begin()
    bench.end()
    assert bench.log().ticks == []


def test_results_are_those_of_the_ports_themselves() -> None:
    bench = Bench()
    bench.begin()
    p = bench.ports
    assert p.clock.now_ns() == bench.clock.now_ns()
    assert p.force_sensor.read() is bench.sensor.read()
    assert p.joint_encoder.read() is bench.encoder.read()
    p.arm.stop()
    assert p.arm.send(JointCommand((0.2, -0.2, 0.3))).reason is CommandReason.STOPPED


def test_a_port_that_fails_is_recorded_and_fails_as_before() -> None:
    bench = Bench()
    bench.begin()
    bench.run(3)
    p = bench.ports
    p.clock.sleep_until(bench.clock.now_ns() + 7_000_000)
    p.clock.now_ns()
    bench.sensor.disconnected = bench.encoder.disconnected = bench.arm.disconnected = True
    with pytest.raises(DeviceError, match="does not answer"):
        p.force_sensor.read()
    with pytest.raises(DeviceError):
        p.joint_encoder.read()
    with pytest.raises(DeviceError):
        p.arm.send(JointCommand((0.2, -0.2, 0.3)))
    p.arm.stop()
    bench.end(error="DeviceError")
    log = bench.log()
    assert ticks_of(log) == [0, 1, 2, 3]
    last = list(log.records())[3]
    assert (last.wrench, last.joints, last.asked_rad, last.applied) == (None, None, None, None)
    assert [(c.tick, c.port, c.call, c.error, c.text, c.asked_rad) for c in log.calls[1:]] == [
        (3, "force_sensor", "read", "DeviceError", "fake force sensor: does not answer", None),
        (3, "joint_encoder", "read", "DeviceError", "fake joint encoder: does not answer", None),
        (3, "arm", "send", "DeviceError", "fake arm: does not answer", (0.2, -0.2, 0.3)),
        (3, "arm", "stop", "", "", None),
    ]


def test_a_refused_command_is_recorded() -> None:
    bench = Bench()
    bench.begin()
    with pytest.raises(CommandError):
        bench.ports.arm.send(JointCommand((0.1,)))
    bench.end()
    assert bench.log().calls[-1].asked_rad == (0.1,)
    assert bench.log().calls[-1].error == "CommandError"


def test_an_error_of_another_kind_passes_too() -> None:
    bench = Bench()
    bench.begin()
    bench.sensor.read = lambda: 1 / 0  # type: ignore[method-assign,assignment,return-value]
    with pytest.raises(ZeroDivisionError):
        bench.ports.force_sensor.read()


def test_a_fault_and_its_end_are_recorded() -> None:
    bench = Bench()
    bench.begin()
    bench.run(1)
    bench.arm.fail("collision")
    assert bench.ports.arm.life is Life.FAULTED
    assert bench.ports.arm.fault == "collision"
    with pytest.raises(FaultLatchedError, match="collision"):
        bench.ports.arm.send(JointCommand((0.1, -0.2, 0.3)))
    bench.ports.arm.acknowledge_fault()
    assert bench.ports.arm.fault is None
    bench.end()
    assert [(c.call, c.error, c.text) for c in bench.log().calls[-1:]] == [("acknowledge_fault", "", "collision")]
    assert bench.log().calls[-2].error == "FaultLatchedError"


def test_a_refused_acknowledgement_is_not_recorded_as_one() -> None:
    bench = Bench()
    bench.begin()
    with pytest.raises(LifecycleError):
        bench.ports.arm.acknowledge_fault()
    bench.end()
    assert [c.call for c in bench.log().calls] == ["now_ns"]


def test_the_arm_is_stopped_before_the_log_is_told() -> None:
    bench, order = Bench(), []
    bench.begin()
    bench.arm.stop = lambda: order.append("arm")  # type: ignore[method-assign]
    tell = bench.recorder.call
    bench.recorder.call = lambda entry: (order.append("log"), tell(entry))[1]  # type: ignore[method-assign]
    bench.ports.arm.stop()
    assert order == ["arm", "log"]


def test_an_arm_that_cannot_be_stopped_is_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench()
    bench.begin()

    def fail() -> None:
        raise DeviceError("arm", "cable cut")

    monkeypatch.setattr(bench.arm, "stop", fail)
    with pytest.raises(DeviceError, match="cable cut"):
        bench.ports.arm.stop()
    bench.end()
    last = bench.log().calls[-1]
    assert (last.call, last.error, last.text) == ("stop", "DeviceError", "arm: cable cut")


def test_leaving_a_decorated_device_closes_it() -> None:
    bench = Bench()
    bench.arm.deactivate()
    bench.ports.arm.activate()
    assert bench.arm.life is Life.ACTIVE
    bench.ports.arm.close()
    assert bench.arm.life is Life.CLOSED
    with pytest.raises(LifecycleError), bench.ports.arm:  # type: ignore[attr-defined]
        raise AssertionError("never entered")
