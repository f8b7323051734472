"""Faults injected at the four ports: decorators that behave like broken devices, wires and clocks."""

import zlib
from collections import deque
from dataclasses import dataclass, replace
from math import nan
from typing import NamedTuple

import numpy as np

from palpate.core.errors import DeviceError, PalpateError
from palpate.core.ports import (
    CONTROL_RATE_HZ,
    AppliedCommand,
    ArmCommand,
    Clock,
    CommandReason,
    DeviceDecorator,
    ForceSensor,
    JointCommand,
    JointEncoder,
    Ports,
    Validity,
)
from tests.support.sample_faults import SAMPLE_FAULTS, changed

MAX_AGE_NS = 5 * 1_000_000_000 // CONTROL_RATE_HZ
"""Age above which a sample that a fault holds back is marked ``STALE``, unless another is given: five ticks."""
_NS = 1_000_000_000


@dataclass(frozen=True)
class FaultPlan:
    """One fault.

    Attributes:
        kind: A key of ``SAMPLE_FAULTS``; of an arm drop, delay, stuck, disconnect, nan or unit; of a clock clock-jump
            or overrun.
        port: Name of a field of ``Ports``.
        first_tick: Tick at which it begins, counted from the first use of the decorated port.
        duration_ticks: Number of ticks; 0 lasts to the end.
        probability: Chance of striking in each of these ticks.
        magnitude: Value added, or the limit (saturate), or a standard deviation (noise), or a rate per second
            (bias-drift); N, Nm or rad.
        factor: Multiplier of ``unit``.
        delay_ticks: Delay of samples or commands.
        span_ticks: Number of samples that ``repeat`` repeats.
        time_s: Jump of the clock, extra length of a tick, or growth of a ``lag`` per second, s.
        channels: Components, from 0: Fx Fy Fz Tx Ty Tz, or joints; none means all. ``swap`` exchanges two.
        honest: Whether ``saturate`` marks its samples, and ``repeat``, ``lag`` and ``delay`` keep the old times.
        seed: Seed of the fault's random numbers; equal seeds on different ports or kinds give different ones.
    """

    kind: str
    port: str
    first_tick: int = 0
    duration_ticks: int = 0
    probability: float = 1.0
    magnitude: float = 0.0
    factor: float = 1.0
    delay_ticks: int = 3
    span_ticks: int = 14
    time_s: float = 0.0
    channels: tuple[int, ...] = ()
    honest: bool = True
    seed: int = 0


# When a fault strikes.


class Moment(NamedTuple):
    """A tick of one port, counted from 0 at its first use."""

    tick: int
    time_ns: int


class Ticker:
    """Counts the ticks of one port: a use at a later time than the previous one begins a tick."""

    def __init__(self, clock):
        self._clock, self._tick = clock, 0
        self._last_ns = None

    def moment(self):
        now_ns = self._clock.now_ns()
        if self._last_ns is not None and now_ns > self._last_ns:
            self._tick += 1
        self._last_ns = now_ns
        return Moment(self._tick, now_ns)


class Schedule:
    """Decides in each tick whether a fault strikes."""

    def __init__(self, plan, notify):
        self.plan, self._notify = plan, notify
        # Without the name, losses on two ports with equal seeds would fall on the same ticks.
        name = zlib.crc32(f"{plan.port}.{plan.kind}".encode())
        self.rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(name,)))
        self._tick = None
        self._begin = None
        self._strikes = False

    def strikes(self, moment):
        """Return the same answer throughout a tick."""
        if moment.tick != self._tick:
            self._tick = moment.tick
            if self._begin is None and moment.tick >= self.plan.first_tick:
                self._begin = moment.tick
            self._strikes = self._lasts(moment.tick) and self._chance()
        return self._strikes

    def delivered(self, moment):
        if self._notify is not None:
            self._notify(moment)

    def _lasts(self, tick):
        duration = self.plan.duration_ticks
        return self._begin is not None and (duration == 0 or tick - self._begin < duration)

    def _chance(self):
        return self.plan.probability >= 1.0 or self.rng.random() < self.plan.probability


# Decorated ports.


class _FaultySensor(DeviceDecorator):
    """A sensor with faults; the first of them is next to the device."""

    PORT = ""

    def __init__(self, sensor, clock, plans, notify=None, *, max_age_ns=MAX_AGE_NS):
        super().__init__(sensor)
        self._read, self._ticker, self._max_age_ns = sensor.read, Ticker(clock), max_age_ns
        schedules = [Schedule(plan, notify) for plan in plans if plan.port == self.PORT]
        self._stages = [
            (schedule, SAMPLE_FAULTS[schedule.plan.kind](schedule.plan, schedule.rng)) for schedule in schedules
        ]
        self._tick = None
        self._outcome = None

    def read(self):
        fresh = self._read()
        if not self._stages:
            return fresh
        moment = self._ticker.moment()
        if moment.tick != self._tick or self._outcome is None:
            self._tick = moment.tick
            self._outcome = self._struck(fresh, moment)
        if isinstance(self._outcome, DeviceError):
            raise self._outcome
        return self._outcome

    def _struck(self, fresh, moment):
        sample = fresh
        for schedule, fault in self._stages:
            if not schedule.strikes(moment):
                fault.pass_by(sample)
                continue
            before = sample
            try:
                sample = fault.strike(before, moment)
            except DeviceError as error:
                schedule.delivered(moment)
                return error
            if sample is not before:
                schedule.delivered(moment)
        over_age = moment.time_ns - sample.source_time_ns > self._max_age_ns
        if sample is fresh or not over_age or sample.validity is Validity.INVALID:
            return sample
        return replace(sample, validity=Validity.STALE)


class FaultyForceSensor(_FaultySensor, ForceSensor):
    """A force sensor with faults."""

    PORT = "force_sensor"


class FaultyJointEncoder(_FaultySensor, JointEncoder):
    """Joint encoders with faults."""

    PORT = "joint_encoder"


class CommandFault:
    """A fault between the task and the arm. None stands for a command that does not arrive."""

    def __init__(self, plan):
        self._plan = plan
        self._under_way = deque()

    def strike(self, command, moment, held_rad):
        """Return what arrives instead of a command."""
        plan = self._plan
        match plan.kind:
            case "drop":
                return None
            case "delay":
                return self._late(command, moment.tick)
            case "stuck":
                return None if held_rad is None else JointCommand(held_rad)
            case "disconnect":
                raise DeviceError(plan.port, "does not answer")
        factor = nan if plan.kind == "nan" else plan.factor
        return command and JointCommand(changed(command.position_rad, plan.channels, lambda i, value: factor * value))

    def clear(self):
        self._under_way.clear()

    def _late(self, command, tick):
        if command is not None:
            self._under_way.append((tick + self._plan.delay_ticks, command))
        arrived = None
        while self._under_way and self._under_way[0][0] <= tick:
            arrived = self._under_way.popleft()[1]
        return arrived


class FaultyArm(DeviceDecorator, ArmCommand):
    """An arm with faults. A stop always reaches it, and nothing that was under way arrives after one."""

    def __init__(self, arm, clock, plans, notify=None):
        super().__init__(arm)
        self._arm, self._ticker, self.stopped = arm, Ticker(clock), False
        schedules = [Schedule(plan, notify) for plan in plans if plan.port == "arm"]
        self._stages = [(schedule, CommandFault(schedule.plan)) for schedule in schedules]
        self._held = None

    def send(self, command):
        if self.stopped:
            return self._arm.send(command)
        arriving, acknowledged = self._struck(command)
        if arriving is None:
            return AppliedCommand(command.position_rad)
        applied = self._arm.send(arriving)
        self._held = applied.position_rad
        hidden = acknowledged and applied.reason is not CommandReason.STOPPED
        return AppliedCommand(command.position_rad) if hidden else applied

    def stop(self):
        self.stopped = True
        self._arm.stop()

    def _struck(self, command):
        """Return what arrives at the arm, and whether the answer hides it."""
        moment, acknowledged = self._ticker.moment(), False
        on_way = command
        for schedule, fault in self._stages:
            if not schedule.strikes(moment):
                fault.clear()
                continue
            before = on_way
            try:
                on_way = fault.strike(before, moment, self._held)
            except PalpateError:
                schedule.delivered(moment)
                raise
            if on_way is not before:
                schedule.delivered(moment)
                # A bus that only queues a command answers as if it was applied.
                acknowledged = acknowledged or schedule.plan.kind != "unit"
        return on_way, acknowledged


class FaultyClock(Clock):
    """A clock with faults. A sleep begins a tick; faults come at its end.

    After a jump backwards the clock stands still until time has caught up, because the port forbids less.
    """

    def __init__(self, clock, plans, notify=None):
        self._clock, self._schedules = clock, [Schedule(plan, notify) for plan in plans if plan.port == "clock"]
        self._tick = -1
        self._offset_ns = 0
        self._floor_ns = None
        self._jumped = set()

    def now_ns(self):
        shown_ns = self._clock.now_ns() + self._offset_ns
        if self._floor_ns is not None:
            shown_ns = max(shown_ns, self._floor_ns)
        self._floor_ns = shown_ns
        return shown_ns

    def sleep_until(self, deadline_ns):
        if self.now_ns() < deadline_ns:
            self._clock.sleep_until(deadline_ns - self._offset_ns)
        self._tick += 1
        moment = Moment(self._tick, self._clock.now_ns())
        for number, schedule in enumerate(self._schedules):
            if not schedule.strikes(moment) or number in self._jumped:
                continue
            shift_ns = round(schedule.plan.time_s * _NS)
            if schedule.plan.kind == "overrun":
                self._clock.sleep_until(self._clock.now_ns() + shift_ns)
            else:
                self._jumped.add(number)
                # The present time is shown first, so that no later one can be before it.
                self.now_ns()
                self._offset_ns += shift_ns
            schedule.delivered(moment)


def faulty(ports, plans, notify=None, *, max_age_ns=MAX_AGE_NS):
    """Decorate the four ports. Faults of one port meet what passes in the order of the plans."""
    clock = ports.clock
    return Ports(
        FaultyClock(clock, plans, notify),
        FaultyForceSensor(ports.force_sensor, clock, plans, notify, max_age_ns=max_age_ns),
        FaultyJointEncoder(ports.joint_encoder, clock, plans, notify, max_age_ns=max_age_ns),
        FaultyArm(ports.arm, clock, plans, notify),
    )
