"""The arm in a process of its own: deadman, latch, both ways of dying. Virtual time, emulated buses."""

from collections.abc import Callable
from typing import Any

import pytest

from palpate.adapters.hardware.bus_process import OperatorsHand
from palpate.adapters.hardware.plugins import ArmAdapter
from palpate.core.errors import CommandError, FaultLatchedError
from palpate.core.ports import CommandReason, JointCommand, Life
from palpate.core.ports.contracts import TICK_NS
from tests.contracts import test_cia402, test_zebra
from tests.fake_devices import FakeArm, FakeJointEncoder
from tests.hosted import Hosted
from tests.virtual_time import VirtualTime

MS = 1_000_000
DEADMAN_NS = 100 * MS


class Fakes:
    """A hosted fake arm, active."""

    def __init__(self) -> None:
        self.clock = VirtualTime()
        self.servos = FakeArm(self.clock, (0.0,), lower_rad=(-1.0,), upper_rad=(1.0,), max_step_rad=0.1)
        self.encoder = FakeJointEncoder(self.clock, self.servos.position_rad)
        self.hosted = Hosted(ArmAdapter(self.encoder, self.servos), self.clock, DEADMAN_NS)
        self.arm = self.hosted.arm
        self.arm.configure()
        self.arm.activate()

    def send(self, angle: float = 0.05, *more: float) -> CommandReason:
        return self.arm.send(JointCommand((angle, *more))).reason

    def pass_ms(self, ms: float) -> None:
        self.clock.sleep(ms * 1e-3)


@pytest.fixture
def fakes() -> Any:
    made = Fakes()
    yield made
    made.arm.close()
    made.clock.wait_for(lambda: not any(h.thread.is_alive() for h in made.hosted.started), made.clock.now_ns() + 10**10)


@pytest.mark.parametrize("make", [test_zebra.Bench, test_cia402.Bench])
def test_an_arm_on_a_bus_goes_on_no_longer_than_its_loop_and_only_a_person_sets_it_free(
    make: Callable[[], Any],
) -> None:
    bench = make()
    where = bench.plant.joints_rad if hasattr(bench, "plant") else bench.motors.targets_rad
    with bench.desk:
        hosted = Hosted(ArmAdapter(bench.arm, bench.arm), bench.clock, DEADMAN_NS)
        arm = hosted.arm
        arm.configure()
        arm.activate()
        far = JointCommand((bench.arm.read().position_rad[0] + 0.19, *bench.arm.read().position_rad[1:]))
        arm.send(far)
        begin_rad = where()
        bench.clock.sleep(0.09)
        assert where() != begin_rad
        assert arm.life is Life.ACTIVE
        bench.clock.sleep(0.06)
        rest_rad = where()
        bench.clock.sleep(0.3)
        assert where() == pytest.approx(rest_rad, abs=1e-3)
        assert arm.life is Life.FAULTED
        assert str(arm.fault).startswith("deadman: no set-point for 10")
        for request in (lambda: arm.send(far), arm.activate):
            with pytest.raises(FaultLatchedError, match="deadman: no set-point"):
                request()
        arm.acknowledge_fault()
        arm.activate()
        assert arm.send(far).reason is not CommandReason.STOPPED
        arm.close()


def test_a_loop_that_keeps_sending_or_has_stopped_the_arm_need_not_fear_the_deadman(fakes: Fakes) -> None:
    for _ in range(30):
        assert fakes.send() is CommandReason.AS_ASKED
        fakes.clock.sleep_until(fakes.clock.now_ns() + TICK_NS)
    fakes.arm.stop()
    assert fakes.send() is CommandReason.STOPPED
    fakes.pass_ms(500)
    assert fakes.arm.life is Life.ACTIVE


def test_a_loop_that_is_gone_leaves_an_arm_at_rest_and_nobody_behind(fakes: Fakes) -> None:
    fakes.send(0.1)
    fakes.hosted.started[0].wire.close()
    fakes.pass_ms(1)
    rest_rad = fakes.servos.position_rad()
    fakes.pass_ms(1000)
    assert (fakes.servos.position_rad(), fakes.servos.life) == (rest_rad, Life.CLOSED)
    host = fakes.hosted.started[0]
    assert (host.was_left, host.thread.is_alive()) == (True, False)


def test_a_process_that_dies_is_a_fault_at_once_and_acknowledging_it_starts_another(fakes: Fakes) -> None:
    fakes.send()
    fakes.hosted.started[0].host._wire.close()
    with pytest.raises(FaultLatchedError, match=r"fake arm: .*arm's process was killed by SIGKILL; what stops the arm"):
        fakes.send()
    fakes.arm.stop()
    fakes.servos.__init__(  # type: ignore[misc]  # the device, as a new process finds it
        fakes.clock, (0.0,), lower_rad=(-1.0,), upper_rad=(1.0,), max_step_rad=0.1
    )
    fakes.encoder.__init__(fakes.clock, fakes.servos.position_rad)  # type: ignore[misc]
    fakes.arm.acknowledge_fault()
    fakes.arm.activate()
    assert (fakes.send(), len(fakes.hosted.started)) == (CommandReason.AS_ASKED, 2)


def test_a_process_that_hangs_keeps_nobody_waiting_and_is_a_fault(
    fakes: Fakes, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert fakes.send(0.05) is CommandReason.AS_ASKED
    fakes.pass_ms(5)
    monkeypatch.setattr(fakes.servos, "send", lambda _: fakes.pass_ms(500))
    begin_ns = fakes.clock.now_ns()
    held = fakes.arm.send(JointCommand((0.09,)))
    assert (held.position_rad, held.reason) == ((0.05,), CommandReason.VELOCITY_LIMIT)
    assert fakes.clock.now_ns() - begin_ns <= 3 * MS
    fakes.pass_ms(110)
    with pytest.raises(FaultLatchedError, match=r"process has not run for 1.. ms"):
        fakes.arm.read()
    fakes.pass_ms(500)


def test_an_operator_s_stop_latches_where_the_arm_is(fakes: Fakes) -> None:
    fakes.send(0.1)
    OperatorsHand(fakes.arm).stop()
    rest_rad = fakes.servos.position_rad()
    # Whatever the adapter itself makes of it.
    fakes.servos._stopped = False
    for _ in range(3):
        assert fakes.send(0.1) is CommandReason.STOPPED
        fakes.pass_ms(20)
    fakes.arm.deactivate()
    assert fakes.servos.position_rad() == rest_rad
    with pytest.raises(FaultLatchedError, match="operator's stop"):
        fakes.arm.activate()
    fakes.arm.acknowledge_fault()
    fakes.arm.activate()
    assert fakes.send() is CommandReason.AS_ASKED


def test_an_error_comes_through_as_it_is(fakes: Fakes) -> None:
    with pytest.raises(CommandError) as own:
        fakes.servos.send(JointCommand((0.0, 0.0)))
    with pytest.raises(CommandError) as through:
        fakes.send(0.0, 0.0)
    assert (str(through.value), through.value.value) == (str(own.value), own.value.value)


def test_what_waited_while_its_process_stood_still_is_not_made_up_for(
    fakes: Fakes, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[float] = []
    send = fakes.servos.send

    def noted(command: JointCommand) -> Any:
        sent.append(command.position_rad[0])
        fakes.clock.sleep(0.03)
        return send(command)

    monkeypatch.setattr(fakes.servos, "send", noted)
    for angle in (0.01, 0.02, 0.03, 0.04):
        fakes.send(angle)
    fakes.pass_ms(80)
    assert sent == [0.01, 0.04]
