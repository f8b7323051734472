"""What keeps a rig still after a trip or a device's fault, whoever calls next, until a person acknowledges by name."""

from dataclasses import dataclass

from palpate.core.errors import ConfigurationError, FaultLatchedError, LifecycleError

_NAME = "supervisor"


@dataclass(frozen=True, slots=True)
class Acknowledgement:
    """A person's decision that trials may go on after a trip or a fault.

    Raises:
        ConfigurationError: Nobody is named, or no reason is given.
    """

    by: str
    reason: str
    cause: str

    def __post_init__(self) -> None:
        for name, what in (("by", "the name of a person"), ("reason", "why it is safe to go on")):
            if not getattr(self, name).strip():
                raise ConfigurationError(f"acknowledgement.{name}", getattr(self, name), what)


class FaultLatch:
    """One for each open rig, and shared by all supervisors that watch it.

    Attributes:
        cause: What tripped or failed; empty while nothing has.
        acknowledgements: All of them so far, in order; the log of every later trial holds them.
    """

    def __init__(self) -> None:
        self.cause = ""
        self.acknowledgements: list[Acknowledgement] = []

    @property
    def remedy(self) -> str:
        """What a person has to do."""
        return "acknowledge it before going on"

    def set(self, cause: str) -> None:
        """Something tripped or failed; the first cause stays."""
        self.cause = self.cause or cause

    def release(self) -> None:
        """Clear it without a person: only in the simulator, where each trial starts with a fresh world."""
        self.cause = ""

    def require_free(self) -> None:
        """Before anything is begun.

        Raises:
            FaultLatchedError: A trip or fault has not been acknowledged.
        """
        if self.cause:
            raise FaultLatchedError(_NAME, self.cause, self.remedy)

    def acknowledge(self, by: str, reason: str) -> None:
        """Let trials begin again; a person's decision, never a program's.

        Raises:
            LifecycleError: Nothing has tripped.
            ConfigurationError: Nobody is named, or no reason is given.
        """
        if not self.cause:
            raise LifecycleError(_NAME, "active", "acknowledge()", "there is no trip")
        self.acknowledgements.append(Acknowledgement(by, reason, self.cause))
        self.cause = ""
