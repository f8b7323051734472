"""How late ticks are on a real clock, and whose fault that is.

    python -m benchmarks.jitter --seconds 600 --rig mujoco            the work cell in real time
    python -m benchmarks.jitter --seconds 600 --rig emulated --rt     devices behind wires, in another process
    python -m benchmarks.jitter --seconds 600 --rig fake --rate 1000  the fakes, at any rate
    python -m benchmarks.jitter --seconds 600 --rig sleep --rt        nothing but sleeping: the machine's own floor
    python -m benchmarks.jitter --seconds 600 --rig sum --rt          sleeping, then adding numbers for a fixed time
    python -m benchmarks.jitter --cost                                what measuring itself costs

The core's rate is 140 Hz and fixed: ``mujoco`` and ``emulated`` run whole trials at it. ``fake`` runs a loop with the
same port calls in the same order; its step is what the core does in every tick (samples to the task frame, reference
and inverse kinematics) on the core's own objects, without phases and decisions.
"""

from __future__ import annotations

import argparse
import os
import time
from collections import Counter, deque
from dataclasses import replace
from pathlib import Path
from statistics import median

from benchmarks.emulated_rig import emulated_rig
from benchmarks.paced_clock import PacedClock
from palpate.adapters.config.real_time import RealTimeConfig
from palpate.adapters.config.run import RunConfig, scenario
from palpate.adapters.experiments.build import build_perception, build_task, task_actions
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.hardware.approach import find_approach
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.real_time import (
    Cause,
    Limits,
    RealTime,
    Stopwatch,
    ThreadAccount,
    table,
)
from palpate.adapters.hardware.rig import HardwareRig
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.control_loop import LoopObserver, next_snapshot, run_trial, trial_ticks
from palpate.core.errors import PalpateError
from palpate.core.policy import RandomWalkPolicy
from palpate.core.ports.contracts import FakeClock
from palpate.core.ports.devices import Clock, Ports
from palpate.core.ports.lifecycle import Life, ManagedDevice
from palpate.core.ports.rig import Rig
from palpate.core.ports.values import CONTROL_RATE_HZ, AppliedCommand, JointCommand, JointVector, Snapshot
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import find_ready_pose
from tests.fake_devices import FakeArm, FakeForceSensor, FakeJointEncoder

NS = 10**9
FLOORS = {"sleep": range(0), "sum": range(12_000)}
"""Nothing of ours to do; the sum takes about as long as the core with the fakes."""
ENDS = 1000
SHOWN = 10


class WatchedPhase(Clock):
    """Over the clock of a run: ends the run when its time is over, and watches the phase of the schedule."""

    def __init__(self, clock: Clock, rate_Hz: int, seconds: float) -> None:
        self.clock, self.rate_Hz = clock, rate_Hz
        self.seconds = seconds
        self.begin()
        self.task: InsertionTask | None = None
        self.start_ns, self.starting = 0, True
        self.worst_phase_ns = self.last_slot = 0
        self.deadline_ns: int | None = None
        self.first: list[int] = []
        self.last: deque[int] = deque(maxlen=ENDS)

    def begin(self) -> None:
        """The run's time counts from now."""
        self.end_ns = time.monotonic_ns() + round(self.seconds * NS)

    @property
    def over(self) -> bool:
        return time.monotonic_ns() >= self.end_ns

    def now_ns(self) -> int:
        now = self.clock.now_ns()
        if self.starting:
            self.start_ns, self.starting = now, False
        elif self.deadline_ns is not None:
            late = now - self.deadline_ns
            self.deadline_ns = None
            self.last.append(late)
            if len(self.first) < ENDS:
                self.first.append(late)
        return now

    def sleep_until(self, deadline_ns: int) -> None:
        self.last_slot = round((deadline_ns - self.start_ns) * self.rate_Hz / NS)
        phase = deadline_ns - (self.start_ns + self.last_slot * NS // self.rate_Hz)
        self.worst_phase_ns = max(self.worst_phase_ns, abs(phase))
        if self.task is not None and self.over:
            self.task.interrupt()
        self.clock.sleep_until(deadline_ns)
        self.deadline_ns = deadline_ns


class OpenTask(InsertionTask):
    """Can be used one tick at a time without phases and decisions."""

    def start_at(self, position_rad: JointVector) -> None:
        self._motion.start(position_rad)

    def plain_step(self, snapshot: Snapshot) -> JointCommand:
        self._measurement.update(snapshot)
        return self._motion.move((0.002 if snapshot.tick % 200 < 100 else -0.002, 0.0, 0.0))


def open_task(config: RunConfig) -> OpenTask:
    ready, walk = find_ready_pose(config.arm, config.task), RandomWalkPolicy(task_actions(config))
    task = build_task(config, ready, build_perception(config), walk)
    task.__class__ = OpenTask
    assert isinstance(task, OpenTask)
    # Loops without trials have its account, too.
    task.begin(trial_setup(config, 0))
    return task


def fake_ports(clock: Clock, home_rad: JointVector) -> Ports:
    wide = tuple(abs(q) + 1.0 for q in home_rad)
    arm = FakeArm(clock, home_rad, lower_rad=tuple(-w for w in wide), upper_rad=wide, max_step_rad=0.1)
    sensor, encoder = FakeForceSensor(clock), FakeJointEncoder(clock, arm.position_rad)
    devices: tuple[ManagedDevice, ...] = (sensor, encoder, arm)
    for device in devices:
        device.configure()
        device.activate()
    return Ports(clock, sensor, encoder, arm)


def run_loop(task: OpenTask, ports: Ports, phase: WatchedPhase, watch: LoopObserver) -> None:
    """The loop of ``run_trial`` at any rate, call for call, over a step without phases."""
    clock, sensor, encoder, arm = ports.clock, ports.force_sensor, ports.joint_encoder, ports.arm
    applied: AppliedCommand | None = None
    tick = slot = 0
    rate_Hz = phase.rate_Hz
    try:
        start_ns = clock.now_ns()
        watch.begun(start_ns, task.report)
        while not phase.over:
            deadline_ns = start_ns + slot * NS // rate_Hz
            clock.sleep_until(deadline_ns)
            watch.waited(tick, deadline_ns)
            time_ns = clock.now_ns()
            watch.clock_read(deadline_ns, time_ns)
            wrench = sensor.read()
            watch.force_read(wrench)
            joints = encoder.read()
            watch.joints_read(joints)
            snapshot = Snapshot(tick, time_ns, wrench, joints, applied)
            command = task.plain_step(snapshot)
            watch.acted(command)
            applied = arm.send(command)
            watch.sent(snapshot, command, applied)
            tick, slot = tick + 1, max(slot + 1, (time_ns - start_ns) * rate_Hz // NS + 1)
            watch.ended()
    finally:
        arm.stop()
        watch.stopped(None)


def sleep_only(task: OpenTask, clock: Clock, phase: WatchedPhase, numbers: range, watch: LoopObserver) -> None:
    """The same schedule without anything to do but to add numbers."""
    start_ns, slot = clock.now_ns(), 0
    watch.begun(start_ns, task.report)
    while not phase.over:
        deadline_ns = start_ns + slot * NS // phase.rate_Hz
        clock.sleep_until(deadline_ns)
        watch.waited(slot, deadline_ns)
        time_ns = clock.now_ns()
        watch.clock_read(deadline_ns, time_ns)
        sum(numbers)
        slot = max(slot + 1, (time_ns - start_ns) * phase.rate_Hz // NS + 1)
        watch.ended()


def run_trials(
    config: RunConfig,
    rig: Rig,
    ports: Ports,
    phase: WatchedPhase,
    task: OpenTask,
    rt: RealTime,
    observers: tuple[LoopObserver, ...],
) -> None:
    """Trials until the time is over, in the thread and with the priority of a run."""
    outcomes: Counter[str] = Counter()
    trial = 0
    while not phase.over:
        try:
            rig.prepare(trial)
            if trial == 0:
                # The way to the ready pose does not count.
                phase.begin()
            phase.starting, phase.task, phase.deadline_ns = True, task, None
            with rt.loop():
                report = run_trial(task, ports, trial_setup(config, trial), None, observers)
            outcomes["none" if report.outcome is None else report.outcome.value] += 1
        except PalpateError as error:
            # The script is the person who has looked at it.
            outcomes[f"{error}"] += 1
            rig.return_to_ready()
            if rig.ports.arm.life is Life.FAULTED:
                rig.ports.arm.acknowledge_fault()
        trial += 1
    print(f"{trial} trials: {dict(outcomes)}")


def stolen_ms() -> float:
    """What a hypervisor has taken of all processors since the machine started; 0 on a machine of its own."""
    return int(Path("/proc/stat").read_text().split()[8]) * 1e3 / os.sysconf("SC_CLK_TCK")


def measure(options: argparse.Namespace) -> None:
    config = scenario("paper")
    rate = options.rate if options.rig in ("fake", *FLOORS) else CONTROL_RATE_HZ
    wishes = RealTimeConfig()
    if options.rt:
        wishes = RealTimeConfig(True, options.priority, True, options.cpu, options.garbage, options.awake)
    account = ThreadAccount.if_kept()
    limits = Limits(warn_late_ns=round(options.late_ms * 1e6), warm_up_ticks=wishes.warm_up_ticks)
    # The simulated cell's physics runs within the sleep.
    works = options.rig == "mujoco"
    stopwatch = Stopwatch(limits, rate_Hz=rate, account=account, clock_works=works)
    task = open_task(config)
    observers: tuple[LoopObserver, ...] = () if options.bare else (stopwatch,)
    watcher = LoopObserver() if options.bare else stopwatch
    # Threads of the rig that keep the arm's cycles take the loop's priority.
    config = replace(config, real_time=wishes)
    stolen = stolen_ms()
    with RealTime(wishes) as rt:
        for grant in rt.grants:
            print(grant)

        def watch(ports: Ports) -> tuple[Ports, WatchedPhase]:
            phase = WatchedPhase(ports.clock, rate, options.seconds)
            return replace(ports, clock=phase), phase

        if options.rig in FLOORS:
            ports, phase = watch(
                fake_ports(MonotonicClock(), tuple(find_ready_pose(config.arm, config.task).q_rad.tolist()))
            )
            with rt.loop():
                sleep_only(task, ports.clock, phase, FLOORS[options.rig], watcher)
        elif options.rig == "fake":
            home = tuple(find_ready_pose(config.arm, config.task).q_rad.tolist())
            ports, phase = watch(fake_ports(MonotonicClock(), home))
            task.start_at(home)
            with rt.loop():
                run_loop(task, ports, phase, watcher)
        elif options.rig == "mujoco":
            with SimulatedRig(config, find_ready_pose(config.arm, config.task)) as rig:
                ports, phase = watch(replace(rig.ports, clock=PacedClock(rig.cell)))
                run_trials(config, rig, ports, phase, task, rt, observers)
        else:
            ready = find_ready_pose(config.arm, config.task)
            with (
                emulated_rig(options.arm, options.force, 30 if options.rt else 0) as file,
                HardwareRig(file, config, find_approach(config, ready)) as hardware,
            ):
                ports, phase = watch(hardware.ports)
                run_trials(config, hardware, ports, phase, task, rt, observers)
    report(stopwatch, phase)
    print(f"a hypervisor took {stolen_ms() - stolen:.0f} ms of all processors meanwhile")


def report(stopwatch: Stopwatch, phase: WatchedPhase) -> None:
    print(table(stopwatch))
    late = list(stopwatch.newest_late)
    for tick in late:
        if tick.attribution.cause is Cause.OWN_WORK or tick in late[-SHOWN:]:
            print(f"  {tick}")
    first, last = median(phase.first) * 1e-3, median(phase.last) * 1e-3
    print(
        f"phase of the schedule: at most {phase.worst_phase_ns} ns off (last slot {phase.last_slot});"
        f" median lateness of the first {len(phase.first)} ticks {first:.1f} us, of the last {len(phase.last)}"
        f" {last:.1f} us"
    )


def cost(ticks: int = 20_000, rounds: int = 5) -> None:
    """The loop over the fakes in virtual time, with and without a stopwatch."""
    config = scenario("paper")
    home = tuple(find_ready_pose(config.arm, config.task).q_rad.tolist())
    best: dict[str, float] = {}
    for _ in range(rounds):
        for name in ("bare", "timed", "timed, with the kernel's account"):
            task, ports = open_task(config), fake_ports(FakeClock(), home)
            observers: tuple[LoopObserver, ...] = ()
            if name != "bare":
                account = ThreadAccount.if_kept() if "account" in name else None
                observers = (Stopwatch(Limits(1 << 40, 0, 1 << 40), account=account),)
            loop = trial_ticks(task, ports, trial_setup(config, 0), None, observers)
            snapshot = next(loop, None)
            task.start_at(home)
            for tick in range(-200, ticks):
                if tick == 0:
                    begin = time.thread_time_ns()
                assert snapshot is not None
                snapshot = next_snapshot(loop, task.plain_step(snapshot))
            us = (time.thread_time_ns() - begin) * 1e-3 / ticks
            loop.close()
            best[name] = min(us, best.get(name, us))
    for name, us in best.items():
        print(f"{name}: {us:.2f} us a tick, {us - best['bare']:+.2f} us")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rate", type=int, default=CONTROL_RATE_HZ, help="ticks per second of the fakes")
    parser.add_argument("--rig", choices=("mujoco", "emulated", "fake", *FLOORS), default="mujoco")
    parser.add_argument("--arm", default="zebra-nmc", help="emulated arm")
    parser.add_argument("--force", default="jr3-can", help="emulated force sensor")
    parser.add_argument("--late-ms", type=float, default=1.0, help="a tick later than this is looked into")
    parser.add_argument("--rt", action="store_true", help="ask for SCHED_FIFO and locked memory")
    parser.add_argument("--priority", type=int, default=50)
    parser.add_argument("--cpu", type=int, default=-1, help="with --rt: keep the loop on this CPU")
    parser.add_argument("--garbage", default="as is", help="with --rt: as is, frozen or off")
    parser.add_argument("--awake", action="store_true", help="with --rt: let no processor sleep")
    parser.add_argument("--bare", action="store_true", help="without section timing and causes")
    parser.add_argument("--cost", action="store_true", help="measure what measuring costs, and nothing else")
    options = parser.parse_args()
    if options.rig in ("mujoco", "emulated") and options.rate != CONTROL_RATE_HZ:
        parser.error(f"the core runs at {CONTROL_RATE_HZ} Hz; other rates are for the fakes")
    if options.cost:
        cost()
    else:
        measure(options)


if __name__ == "__main__":
    main()
