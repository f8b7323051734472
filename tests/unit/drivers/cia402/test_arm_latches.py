"""Every fault stops the arm, stays until a person acknowledges it, and then leaves it without power."""

from collections.abc import Callable

import pytest

from palpate.drivers.device import ArmState
from palpate.drivers.errors import DeviceFaultError, DriverError, LateError, SilentError
from palpate.simulation.emulators.cia402.node import NmtState
from palpate.simulation.emulators.cia402.servo import PowerState
from tests.support.cia402_bench import SCALE, Bench

AT_REST = {PowerState.QUICK_STOP, PowerState.SWITCH_ON_DISABLED, PowerState.FAULT, PowerState.FAULT_REACTION}


def drive_fault(bench: Bench) -> None:
    bench.drives[1]._fault()


def emergency(bench: Bench) -> None:
    bench.drives[1].emergency(0x4210, b"\x01\x02")


def host_unheard(bench: Bench) -> None:
    bench.drives[1].emergency(0x8130)


def following_error(bench: Bench) -> None:
    bench.plant.jam(1)
    bench.drives[1].objects[0x6065] = 10


def heartbeat_lost(bench: Bench) -> None:
    bench.drives[1].faults.heartbeat_stopped = True


def no_answers(bench: Bench) -> None:
    bench.drives[1].faults.drop_tpdos = 3


def cut_short(bench: Bench) -> None:
    bench.drives[1].faults.malformed_tpdos = 3


def silence(bench: Bench) -> None:
    bench.drives[1].faults.silent = True


def restart(bench: Bench) -> None:
    bench.drives[1].reset()


def nmt_stopped(bench: Bench) -> None:
    bench.drives[1].nmt = NmtState.STOPPED


def power_lost(bench: Bench) -> None:
    bench.drives[1].machine.state = PowerState.NOT_READY


def strange_state(bench: Bench) -> None:
    bench.drives[1].machine.state = PowerState.SWITCHED_ON
    bench.drives[1].machine.apply = lambda *_, **__: None  # type: ignore[method-assign]


def astray(bench: Bench) -> None:
    bench.drives[1].objects[0x6060] = 0
    bench.plant.set_motor_counts(1, 1.1 * SCALE)
    bench.drives[1]._servo.engage()


def runaway(bench: Bench) -> None:
    bench.plant.set_motor_counts(1, 0.2 * SCALE)
    bench.drives[1]._servo.engage()


def bus_error(bench: Bench) -> None:
    bench.network.notifier.exception = ValueError("non-hexadecimal number found")


def bus_closed(bench: Bench) -> None:
    bench.network.disconnect()


def bus_full(bench: Bench) -> None:
    bench.network.broken = OSError(105, "No buffer space available")


def status(bit: int) -> Callable[[Bench], None]:
    def told(bench: Bench) -> None:
        bench.cycle(times=3)
        bench.drives[1].faults.flipped_status = 1 << bit

    told.__name__ = f"statusword bit {bit}"
    return told


def mode_taken(bench: Bench) -> None:
    bench.drives[1].objects.write(0x6060, 0, b"\0")


def late_answers(bench: Bench) -> None:
    bench.drives[1].faults.delay_tpdos_ns = 5_000_000


def host_away(bench: Bench) -> None:
    bench.network.sleep(0.15)


CASES: list[tuple[Callable[[Bench], None], type[DriverError], str]] = [
    (drive_fault, DeviceFaultError, "drive 2: is in fault"),
    (emergency, DeviceFaultError, "drive 2: reports EMCY 0x4210 .*0102000000"),
    (following_error, DeviceFaultError, "drive 2: reports EMCY 0x8611"),
    (
        host_unheard,
        LateError,
        r"drive 2: has not heard this computer for \d+ ms \(EMCY 0x8130\); check the bus cable, or end",
    ),
    (heartbeat_lost, SilentError, "drive 2: no heartbeat"),
    (no_answers, SilentError, "drive 2: left 3 SYNCs in a row"),
    (cut_short, SilentError, "drive 2: left 3 SYNCs in a row unanswered, and 3 of its frames had another length"),
    (silence, SilentError, "drive 2: left 3 SYNCs in a row"),
    (restart, DeviceFaultError, "drive 2: has restarted"),
    (nmt_stopped, DeviceFaultError, "drive 2: is no longer operational"),
    (power_lost, DeviceFaultError, "drive 2: went to 'not ready to switch on' by itself"),
    (strange_state, DeviceFaultError, "drive 2: went to 'switched on' by itself"),
    (astray, DeviceFaultError, "drive 2: stands at 1.1000 rad"),
    (runaway, DeviceFaultError, "drive 2: moves at"),
    (status(9), DeviceFaultError, r"drive 2: does not obey this bus \(remote, .*from local to remote control"),
    (status(11), DeviceFaultError, r"drive 2: has held back for 0.2 s by a limit of its own \(internal limit"),
    (status(12), DeviceFaultError, r"drive 2: ignores its set-points \(target ignored"),
    (status(13), DeviceFaultError, r"drive 2: has fallen behind its set-points \(following error"),
    (mode_taken, DeviceFaultError, r"drive 2: is in mode 0, not in CSP \(another master"),
    (late_answers, LateError, "drive 2: answered 3 SYNCs in a row too late; end other work here"),
    (host_away, LateError, "this computer kept the drives waiting for 1[56][0-9] ms; after that drive 1: "),
    (bus_error, SilentError, "receiving has ended .*non-hexadecimal"),
    (bus_closed, SilentError, "receiving has ended"),
    (bus_full, SilentError, "does not take frames.*No buffer space"),
]
cases = pytest.mark.parametrize(("provoke", "kind", "told"), CASES, ids=[provoke.__name__ for provoke, _, _ in CASES])


@cases
def test_a_fault_stops_the_arm_and_stays(provoke: Callable[[Bench], None], kind: type[DriverError], told: str) -> None:
    bench = Bench().enabled()
    bench.cycle(0.001)
    provoke(bench)
    with pytest.raises(kind, match=told):
        bench.cycle(0.003, times=40)
    assert bench.arm.state is ArmState.FAULTED
    assert bench.arm.fault is not None
    if bench.network.broken is None:
        assert {d.machine.state for d in bench.drives if d is not bench.drives[1]} <= AT_REST
    sent = len(bench.network.sent)
    for refused in (bench.arm.cycle, bench.arm.enable, bench.arm.disable, lambda: bench.arm.preview((0.0,) * 6)):
        with pytest.raises(DeviceFaultError, match="latched") as refusal:
            refused()
        assert refusal.value.blame is kind.blame
    assert len(bench.network.sent) == sent
    bench.arm.close()


@pytest.mark.parametrize("provoke", [drive_fault, emergency, restart, no_answers])
def test_only_a_person_clears_it_and_the_arm_stays_without_power(provoke: Callable[[Bench], None]) -> None:
    bench = Bench().enabled()
    provoke(bench)
    with pytest.raises(DriverError):
        bench.cycle(times=40)
    bench.arm.acknowledge()
    assert (bench.arm.state, bench.arm.fault) == (ArmState.CONFIGURED, None)
    assert {drive.machine.state for drive in bench.drives} == {PowerState.SWITCH_ON_DISABLED}
    bench.cycle(times=10)
    assert {drive.machine.state for drive in bench.drives} == {PowerState.SWITCH_ON_DISABLED}
    bench.arm.enable()
    assert bench.cycle(0.001).applied is not None


def test_a_fault_that_does_not_go_away_stays_latched() -> None:
    bench = Bench().enabled()
    bench.drives[0].fail(0x3210)
    bench.drives[0].faults.fault_persists = True
    with pytest.raises(DeviceFaultError):
        bench.cycle(times=3)
    with pytest.raises(DeviceFaultError, match="not every drive reached"):
        bench.arm.acknowledge()
    assert bench.arm.state is ArmState.FAULTED
    bench.drives[0].faults.fault_persists = False
    bench.arm.acknowledge()


def test_a_dead_drive_cannot_be_acknowledged() -> None:
    bench = Bench().enabled()
    bench.drives[0].faults.silent = True
    with pytest.raises(SilentError):
        bench.cycle(times=10)
    with pytest.raises(SilentError):
        bench.arm.acknowledge()
    assert bench.arm.state is ArmState.FAULTED


def test_a_drive_in_fault_is_not_enabled() -> None:
    bench = Bench()
    bench.arm.open()
    bench.drives[5]._fault()
    with pytest.raises(DeviceFaultError, match="drive 6: is in fault"):
        bench.arm.enable()
    assert bench.arm.state is ArmState.FAULTED
    assert all(drive.machine.state in AT_REST for drive in bench.drives)
    bench.arm.acknowledge()
    bench.arm.enable()


def test_a_single_lost_answer_is_forgiven() -> None:
    bench = Bench().enabled()
    for _ in range(5):
        bench.drives[3].faults.drop_tpdos = 2
        bench.cycle(0.001, times=3)
    assert bench.arm.state is ArmState.ENABLED


def test_a_drive_that_never_says_that_it_follows_is_believed() -> None:
    bench = Bench()
    bench.drives[1].faults.flipped_status = 1 << 12
    bench.enabled().cycle(0.001, times=10)
    assert bench.arm.state is ArmState.ENABLED


def test_a_drive_under_local_control_is_named_when_it_does_not_get_ready() -> None:
    bench = Bench()
    bench.arm.open()
    bench.drives[1].faults.flipped_status = 1 << 9
    bench.drives[1].machine.apply = lambda *_, **__: None  # type: ignore[method-assign]
    with pytest.raises(DeviceFaultError, match=r"not under remote control: \[2\]"):
        bench.arm.enable()


def test_a_drive_that_does_not_obey_a_stop_is_a_fault() -> None:
    bench = Bench().enabled()
    bench.drives[1].machine.apply = lambda *_, **__: None  # type: ignore[method-assign]
    bench.arm.stop()
    with pytest.raises(DeviceFaultError, match="drive 2: went to 'operation enabled' by itself"):
        bench.cycle(times=10)


def test_one_lost_answer_while_stopping_is_forgiven() -> None:
    bench = Bench().enabled()
    bench.drives[1].faults.drop_tpdos = 1
    bench.arm.stop()
    bench.cycle(times=10)
    assert bench.arm.state is ArmState.STOPPED
