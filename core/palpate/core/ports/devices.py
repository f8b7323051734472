"""The four ports between the core and the world.

They are structural: a stranger's class may just match them. Semantics that types cannot express are
in the contract suites (:mod:`palpate.adapters.contracts`), which every adapter passes:

* Units are SI, angles in rad, time in integer ns of the run's clock.
* A sample carries source time, receive time, sequence number and validity; silence is never passed
  off as news: an over-age sample comes back marked ``STALE``, a dead device raises ``DeviceError``.
* What is observed at tick *t* does not depend on the command of tick *t*.
* The newest command wins; there is no backlog. ``send`` returns what was really applied.
* ``stop`` works at any time, twice too. A fault latches until a person acknowledges it.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import AppliedCommand, JointCommand, JointSample, WrenchSample


@runtime_checkable
class Device(Protocol):
    """Life cycle shared by the three device ports; see :mod:`palpate.core.ports.lifecycle`."""

    @property
    @abstractmethod
    def life(self) -> Life:
        """Where in its life the device is."""

    @property
    @abstractmethod
    def fault(self) -> str | None:
        """The latched fault, or None."""

    @abstractmethod
    def configure(self) -> None:
        """Open and check the device; the constructor opens nothing."""

    @abstractmethod
    def activate(self) -> None:
        """Let it act."""

    @abstractmethod
    def deactivate(self) -> None:
        """End what ``activate`` began."""

    @abstractmethod
    def acknowledge_fault(self) -> None:
        """Clear a latched fault; a person's decision."""

    @abstractmethod
    def close(self) -> None:
        """Release it for good; allowed at any time, twice too."""


@runtime_checkable
class ForceSensor(Device, Protocol):
    """Six-axis force/torque sensor at the wrist."""

    @abstractmethod
    def read(self) -> WrenchSample:
        """Newest wrench of the environment on the tool, in the sensor frame.

        Raises:
            LifecycleError: The sensor is not active.
            DeviceError: The device is gone.
        """


@runtime_checkable
class JointEncoder(Device, Protocol):
    """Joint angles of the arm."""

    @abstractmethod
    def read(self) -> JointSample:
        """Newest joint angles.

        Raises:
            LifecycleError: The encoder is not active.
            DeviceError: The device is gone.
        """


@runtime_checkable
class ArmCommand(Device, Protocol):
    """The arm's joint servos."""

    @abstractmethod
    def send(self, command: JointCommand) -> AppliedCommand:
        """Hand the servos new set-points; gives the command after the arm's own limits, and why it differs.

        Raises:
            LifecycleError: The arm is not active.
            FaultLatchedError: A fault waits to be acknowledged.
            CommandError: The number of joints is wrong.
        """

    @abstractmethod
    def stop(self) -> None:
        """Bring the arm to rest where it is; works in every state, from any thread, and never raises for being late.

        It may come in the middle of ``send``, as from a signal handler; what is left of that moves nothing.

        After ``stop`` an active arm holds still and ``send`` applies nothing (reason ``STOPPED``)
        until the arm is deactivated and activated again.
        """


@runtime_checkable
class Clock(Protocol):
    """The run's time: integer nanoseconds that never go back."""

    @abstractmethod
    def now_ns(self) -> int:
        """Time now."""

    @abstractmethod
    def sleep_until(self, deadline_ns: int) -> None:
        """Return once ``now_ns() >= deadline_ns``; at once when that is already so."""


@dataclass(frozen=True, slots=True)
class Ports:
    """The four ports that a run uses; simulator, hardware or recorded trial, the core cannot tell."""

    clock: Clock
    force_sensor: ForceSensor
    joint_encoder: JointEncoder
    arm: ArmCommand
