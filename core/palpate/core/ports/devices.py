"""The four ports between the core and its environment.

The ports are structural types: a third-party class only needs the same members. Semantics that types cannot express are
specified by the contract suites (:mod:`palpate.adapters.contracts`), which every adapter must pass.

Units are SI, with angles in rad and times in integer ns on the run's clock. A sample carries its source time, receive
time, sequence number and validity. Silence is never hidden: an old sample is marked ``STALE``, and a dead device raises
``DeviceError``. Observations at tick *t* do not depend on the command at tick *t*. Only the latest command counts;
there is no queue. ``send`` returns the applied command. ``stop`` works at any time, even repeatedly. A fault latches
until a person acknowledges it.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.core.ports.lifecycle import Device
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, WrenchSample


@runtime_checkable
class ForceSensor(Device, Protocol):
    """Six-axis force/torque sensor at the wrist."""

    @abstractmethod
    def read(self) -> WrenchSample:
        """Return the latest wrench exerted by the environment on the tool, in the sensor frame.

        Raises:
            LifecycleError: The sensor is not active.
            DeviceError: The device is no longer available.
        """


@runtime_checkable
class JointEncoder(Device, Protocol):
    """Encoders that measure the arm's joint angles."""

    @abstractmethod
    def read(self) -> JointSample:
        """Return the latest joint angles.

        Raises:
            LifecycleError: The encoder is not active.
            DeviceError: The device is no longer available.
        """


@runtime_checkable
class ArmCommand(Device, Protocol):
    """The arm's joint servos, which receive the commands."""

    @abstractmethod
    def send(self, command: JointCommand) -> AppliedCommand:
        """Send new set-points to the servos; return the applied command, with the reason for any change.

        Raises:
            LifecycleError: The arm is not active.
            FaultLatchedError: A fault has not been acknowledged.
            CommandError: The number of joints is wrong.
        """

    @abstractmethod
    def stop(self) -> None:
        """Stop the arm at its current pose; works in every state and from any thread, even when the loop is late.

        It may interrupt ``send``, for example from a signal handler; the rest of that ``send`` causes no motion.

        After ``stop`` an active arm holds its position, and ``send`` applies nothing (reason ``STOPPED``) until the arm
        is deactivated and activated again.
        """


@runtime_checkable
class Clock(Protocol):
    """The run's monotonic clock, in integer nanoseconds."""

    @abstractmethod
    def now_ns(self) -> int:
        """Return the current time."""

    @abstractmethod
    def sleep_until(self, deadline_ns: int) -> None:
        """Return once ``now_ns() >= deadline_ns``, or immediately if that time has passed."""


@dataclass(frozen=True, slots=True)
class Ports:
    """A run's four ports, the same for a simulator, hardware and a recorded trial."""

    clock: Clock
    force_sensor: ForceSensor
    joint_encoder: JointEncoder
    arm: ArmCommand
