"""Faults injected at the four ports: decorators that behave like broken devices, wires and clocks.

A decorated port still *is* the port, so that a trial runs over it unchanged::

    plans = [FaultPlan("drop", "force_sensor", first_tick=300, duration_ticks=20)]
    run_trial(task, faulty(rig.ports, plans), setup)

A stop and the life cycle always pass through. The rig keeps the plain ports; decorate again for each trial, because
ticks count from a port's first use.
"""

import zlib
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import copysign, nan
from typing import ClassVar, Generic, NamedTuple

import numpy as np
from typing_extensions import override

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
    JointSample,
    Ports,
    SampleT,
    Validity,
    WrenchSample,
)

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


Notify = Callable[[Moment], object]
"""Called whenever a fault has changed something."""


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


# Faults of samples.

_Change = Callable[[int, float], float]
"""A function of a channel's number and value."""


def channels_of(sample):
    """Return Fx Fy Fz Tx Ty Tz in N and Nm, or the joint angles in rad."""
    return (*sample.force_N, *sample.torque_Nm) if isinstance(sample, WrenchSample) else sample.position_rad


def with_channels(sample, values, validity):
    if isinstance(sample, WrenchSample):
        fx, fy, fz, tx, ty, tz = values
        return replace(sample, force_N=(fx, fy, fz), torque_Nm=(tx, ty, tz), validity=validity)
    return replace(sample, position_rad=tuple(values), validity=validity)


def changed(values, channels, change):
    """Return the values with a change made to some of them, or to all where no channels are given."""
    chosen = channels or range(len(values))
    return tuple(change(i, value) if i in chosen else value for i, value in enumerate(values))


class SampleFault(ABC, Generic[SampleT]):
    """A fault between a sensor and its reader; each tick it either strikes or lets the sample pass."""

    def __init__(self, plan, rng):
        self.plan, self._rng = plan, rng
        self._last = None

    def pass_by(self, sample):
        self._last = sample

    @abstractmethod
    def strike(self, sample, moment):
        """Return the sample that is read instead; the same object if there is nothing to change."""

    def _required(self, sample):
        if sample is None:
            raise DeviceError(self.plan.port, "has not delivered a sample yet")
        return sample

    def _instead_of(self, sample, old):
        """Return an older sample, with the number and times of the new measurement if the fault is not honest."""
        if self.plan.honest:
            return old
        new_times = (sample.source_time_ns, sample.receive_time_ns)
        return replace(old, source_time_ns=new_times[0], receive_time_ns=new_times[1], sequence=sample.sequence)


class Drop(SampleFault[SampleT]):
    """The new sample is lost."""

    @override
    def strike(self, sample, moment):
        return self._required(self._last)


class Delay(SampleFault[SampleT]):
    """Every sample comes late, with its true times; if not honest, the sensor falls back at once instead."""

    def __init__(self, plan, rng):
        super().__init__(plan, rng)
        self._under_way = deque()
        self._shown = deque(maxlen=plan.delay_ticks + 1)

    @override
    def pass_by(self, sample):
        self._last = sample
        self._shown.append(sample)
        self._under_way.clear()

    @override
    def strike(self, sample, moment):
        if not self.plan.honest:
            self._shown.append(sample)
            return self._instead_of(sample, self._shown[0])
        self._under_way.append((moment.tick + self.plan.delay_ticks, sample))
        while self._under_way[0][0] <= moment.tick:
            self._last = replace(self._under_way.popleft()[1], receive_time_ns=moment.time_ns)
        return self._required(self._last)


class Duplicate(SampleFault[SampleT]):
    """The previous sample comes again instead of the new one; never the same one three times."""

    @override
    def strike(self, sample, moment):
        last, self._last = self._last, None
        if last is None:
            self._last = sample
            return sample
        return replace(last, receive_time_ns=moment.time_ns)


class Repeat(SampleFault[SampleT]):
    """The samples before the fault come again and again."""

    def __init__(self, plan, rng):
        super().__init__(plan, rng)
        self._stretch = deque(maxlen=plan.span_ticks)
        self._next = 0

    @override
    def pass_by(self, sample):
        self._stretch.append(sample)
        self._next = 0

    @override
    def strike(self, sample, moment):
        if not self._stretch:
            return sample
        old = self._stretch[self._next % len(self._stretch)]
        self._next += 1
        return self._instead_of(sample, old)


class Lag(SampleFault[SampleT]):
    """Samples come later and later, as through a buffer that fills."""

    def __init__(self, plan, rng):
        super().__init__(plan, rng)
        self._under_way = deque()
        self._since_ns = None

    @override
    def pass_by(self, sample):
        self._last, self._since_ns = sample, None
        self._under_way.clear()

    @override
    def strike(self, sample, moment):
        if self._since_ns is None:
            self._since_ns = moment.time_ns
        late_ns = round(self.plan.time_s * (moment.time_ns - self._since_ns))
        self._under_way.append(sample)
        while self._under_way and self._under_way[0].source_time_ns + late_ns <= moment.time_ns:
            self._last = replace(self._under_way.popleft(), receive_time_ns=moment.time_ns)
        return self._instead_of(sample, self._required(self._last))


class Disconnect(SampleFault[SampleT]):
    """The device is gone."""

    @override
    def strike(self, sample, moment):
        raise DeviceError(self.plan.port, "does not answer")


class Struck(NamedTuple):
    """Inputs of a change of values, in addition to the value itself.

    Attributes:
        held: Values of the last sample before the fault.
        lasted_ns: Time since the fault began.
    """

    plan: FaultPlan
    rng: np.random.Generator
    values: tuple[float, ...]
    held: tuple[float, ...]
    lasted_ns: int


def _spike(struck):
    error = struck.plan.magnitude if struck.rng.random() < 0.5 else -struck.plan.magnitude
    return lambda i, value: value + error


def _swap(struck):
    one, other = struck.plan.channels
    return lambda i, value: struck.values[other if i == one else one]


_CHANGES = {
    "freeze": lambda struck: lambda i, value: struck.held[i],
    "bias-drift": lambda struck: lambda i, value: value + struck.plan.magnitude * struck.lasted_ns / _NS,
    # After "freeze": the noise of an amplifier whose gauges are dead.
    "noise": lambda struck: lambda i, value: value + struck.plan.magnitude * float(struck.rng.standard_normal()),
    "offset": lambda struck: lambda i, value: value + struck.plan.magnitude,
    "swap": _swap,
    "spike": _spike,
    "nan": lambda struck: lambda i, value: nan,
    "saturate": lambda struck: lambda i, value: copysign(struck.plan.magnitude, value),
    "unit": lambda struck: lambda i, value: struck.plan.factor * value,
}


class Changed(SampleFault[SampleT]):
    """Other values, marked where a device would mark them."""

    _since_ns: int | None = None

    @override
    def strike(self, sample, moment):
        self._since_ns = moment.time_ns if self._since_ns is None else self._since_ns
        self._last = sample if self._last is None else self._last
        plan, values, lasted_ns = self.plan, channels_of(sample), moment.time_ns - self._since_ns
        change = _CHANGES[plan.kind](Struck(plan, self._rng, values, channels_of(self._last), lasted_ns))
        validity = Validity.INVALID if plan.kind == "nan" else sample.validity
        if plan.kind == "saturate" and plan.honest and validity is Validity.VALID:
            validity = Validity.SATURATED
        return with_channels(sample, changed(values, plan.channels, change), validity)


SAMPLE_FAULTS = {
    "drop": Drop,
    "delay": Delay,
    "duplicate": Duplicate,
    "repeat": Repeat,
    "lag": Lag,
    "disconnect": Disconnect,
    **dict.fromkeys(_CHANGES, Changed),
}


class _FaultySensor(DeviceDecorator, Generic[SampleT]):
    """A sensor with faults; the first of them is next to the device."""

    PORT: ClassVar[str]

    def __init__(
        self,
        sensor,
        clock,
        plans,
        notify=None,
        *,
        max_age_ns=MAX_AGE_NS,
    ):
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


class FaultyForceSensor(_FaultySensor[WrenchSample], ForceSensor):
    """A force sensor with faults."""

    PORT = "force_sensor"


class FaultyJointEncoder(_FaultySensor[JointSample], JointEncoder):
    """Joint encoders with faults."""

    PORT = "joint_encoder"


# Faults of commands and of time.


class CommandFault:
    """A fault between the task and the arm. None stands for a command that does not arrive."""

    def __init__(self, plan):
        self._plan = plan
        self._under_way = deque()

    @property
    def acknowledges(self):
        """Whether the command is answered as if it was applied as requested, as by a bus that only queues it."""
        return self._plan.kind != "unit"

    def strike(self, command, moment, held_rad):
        """Return what arrives instead of a command.

        Args:
            held_rad: Position that the arm applied last; None before its first command.
        """
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
    """An arm with faults. A stop always reaches it, and nothing that was under way arrives after one.

    Attributes:
        stopped: Whether it was stopped.
    """

    def __init__(self, arm, clock, plans, notify=None):
        super().__init__(arm)
        self._arm, self._ticker, self.stopped = arm, Ticker(clock), False
        schedules = [Schedule(plan, notify) for plan in plans if plan.port == "arm"]
        self._stages = [(schedule, CommandFault(schedule.plan)) for schedule in schedules]
        self._held = None

    @override
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

    @override
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
                acknowledged = acknowledged or fault.acknowledges
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

    @override
    def now_ns(self):
        shown_ns = self._clock.now_ns() + self._offset_ns
        if self._floor_ns is not None:
            shown_ns = max(shown_ns, self._floor_ns)
        self._floor_ns = shown_ns
        return shown_ns

    @override
    def sleep_until(self, deadline_ns):
        if self.now_ns() < deadline_ns:
            self._clock.sleep_until(deadline_ns - self._offset_ns)
        self._tick += 1
        moment = Moment(self._tick, self._clock.now_ns())
        for number, schedule in enumerate(self._schedules):
            strikes = schedule.strikes(moment)
            if schedule.plan.kind == "clock-jump":
                self._jump(number, schedule, moment, strikes)
            elif strikes:
                self._clock.sleep_until(self._clock.now_ns() + round(schedule.plan.time_s * _NS))
                schedule.delivered(moment)

    def _jump(self, number, schedule, moment, strikes):
        if strikes == (number in self._jumped):
            return
        self._jumped ^= {number}
        # The present time is shown first, so that no later one can be before it.
        self.now_ns()
        self._offset_ns += round(schedule.plan.time_s * _NS) * (1 if strikes else -1)
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
