"""The latch that keeps a rig stationary after a trip or a device fault until a person acknowledges it."""

from dataclasses import dataclass

from palpate.core.errors import ConfigurationError, FaultLatchedError, LifecycleError

_NAME = "supervisor"


@dataclass(frozen=True, slots=True)
class Acknowledgement:
    """A person's decision that trials may resume after a trip or a fault.

    Raises:
        ConfigurationError: The name or the reason is empty.
    """

    by: str
    reason: str
    cause: str

    def __post_init__(self) -> None:
        for name, what in (("by", "the name of a person"), ("reason", "why it is safe to go on")):
            if not getattr(self, name).strip():
                raise ConfigurationError(f"acknowledgement.{name}", getattr(self, name), what)


class FaultLatch:
    """The fault latch for an open rig, shared by all supervisors on that rig.

    Attributes:
        cause: The trip or fault; empty if there is none.
        acknowledgements: All acknowledgements so far, in order; every later trial's log contains them.
    """

    def __init__(self) -> None:
        self.cause = ""
        self.acknowledgements: list[Acknowledgement] = []

    @property
    def remedy(self) -> str:
        """Return the action that a person must take."""
        return "acknowledge it first"

    def set(self, cause: str) -> None:
        """Latch a trip or fault; if one is already latched, keep the first cause."""
        self.cause = self.cause or cause

    def release(self) -> None:
        """Clear the latch without a person; for the simulator only, where each trial starts in a new world."""
        self.cause = ""

    def require_free(self) -> None:
        """Raise an error while a fault is latched.

        Raises:
            FaultLatchedError: A trip or fault has not been acknowledged.
        """
        if self.cause:
            raise FaultLatchedError(_NAME, self.cause, self.remedy)

    def acknowledge(self, by: str, reason: str) -> None:
        """Allow trials to begin again; only a person may decide this.

        Raises:
            LifecycleError: No fault is latched.
            ConfigurationError: The name or the reason is empty.
        """
        if not self.cause:
            raise LifecycleError(_NAME, "active", "acknowledge()", "there is no trip")
        self.acknowledgements.append(Acknowledgement(by, reason, self.cause))
        self.cause = ""
