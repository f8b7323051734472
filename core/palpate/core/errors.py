"""Every error that palpate raises on purpose, in one tree.

::

    PalpateError
    ├── ConfigurationError          a setting is wrong: the operator's to fix
    │   ├── AssetError              a robot description or mesh is missing
    │   └── UnreachableError        a pose that the arm cannot take
    ├── UsageError                  a command line that says nothing sensible: the operator's
    ├── OutputError                 writing there would lose what is already on disk
    ├── LogError                    a recorded trial that cannot be read, or not be replayed
    ├── LifecycleError              a port was used in the wrong order: the caller's fault
    ├── CommandError                a command that no arm may execute: the caller's fault
    ├── UndeterminedError           measurements that do not say what is asked of them: measure more
    ├── PolicyError                 a policy from outside failed: its author's to fix
    └── DeviceError                 the device's fault
        └── FaultLatchedError       a fault waits for a person to acknowledge it

Each error says what happened, the offending value, and what would have been right.
"""

import difflib
import os
import sys
from collections.abc import Sequence
from math import isfinite


class PalpateError(Exception):
    """Root of the tree; errors pass between processes as they are."""

    def __reduce__(self) -> tuple[object, ...]:
        return _restored, (type(self), self.args, self.__dict__)


def _restored(kind: type[PalpateError], args: tuple[object, ...], attributes: dict[str, object]) -> PalpateError:
    """Rebuild an error without its constructor, whose arguments it does not keep."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(attributes)
    return error


class ConfigurationError(PalpateError, ValueError):
    """A setting cannot be used."""

    def __init__(self, field: str, value: object, accepted: str) -> None:
        self.field, self.value, self.accepted = field, value, accepted
        super().__init__(f"{field} = {_shown(value)} is refused: {accepted}")


class AssetError(ConfigurationError):
    """A robot description or one of its files is not there."""


class UnreachableError(ConfigurationError):
    """No joint configuration within the limits reaches the pose."""


class UsageError(PalpateError):
    """A command line that cannot be understood."""


class OutputError(PalpateError):
    """Writing would overwrite or mix results."""

    def __init__(self, path: str, problem: str, remedy: str) -> None:
        self.path = path
        super().__init__(f"{path}: {problem}; {remedy}")


class LogError(PalpateError):
    """A recorded trial cannot be used.

    Attributes:
        where: Offset, message or tick; empty when it is the whole file.
    """

    def __init__(self, path: str, where: str, problem: str, remedy: str) -> None:
        self.path, self.where = path, where
        super().__init__(f"{path}: {where + ': ' if where else ''}{problem}; {remedy}")


class LifecycleError(PalpateError, RuntimeError):
    """A port was asked for something that its state does not allow."""

    def __init__(self, who: str, state: str, request: str, accepted: str) -> None:
        self.state, self.request = state, request
        super().__init__(f"{who}: {request} is not possible while {state}; {accepted}")


class CommandError(PalpateError, ValueError):
    """A command that may not be sent to any arm, for example one that is not finite."""

    def __init__(self, problem: str, value: object) -> None:
        self.value = value
        super().__init__(f"{problem}: {_shown(value)}")


class UndeterminedError(PalpateError):
    """Measurements do not determine what is asked of them."""

    def __init__(self, quantity: str, problem: str, missing: str) -> None:
        self.quantity = quantity
        super().__init__(f"{quantity} is not determined: {problem}; what is missing: {missing}")


class PolicyError(PalpateError, RuntimeError):
    """A policy that is not palpate's own failed, or gave what makes no sense. Every way out leaves the arm stopped.

    Attributes:
        policy: What made it, ``package.module:Name``.
    """

    def __init__(self, policy: str, problem: str) -> None:
        self.policy = policy
        super().__init__(f"policy {policy}: {problem}; the fault is the policy's own")


class DeviceError(PalpateError, RuntimeError):
    """The device, or the way to it, failed."""

    def __init__(self, device: str, problem: str) -> None:
        self.device = device
        super().__init__(f"{device}: {problem}")


class FaultLatchedError(DeviceError):
    """The device stopped after a fault and waits until a person acknowledges it."""

    def __init__(self, device: str, cause: str, remedy: str = "acknowledge it before going on") -> None:
        self.cause = cause
        super().__init__(device, f"stopped by a fault ({cause}); {remedy}")


def one_line(said: object) -> str:
    """What an error or another thing says, on one line; of signs that would steer a terminal, their codes."""
    told = " ".join(str(said).split())
    return "".join(sign if sign.isprintable() else ascii(sign)[1:-1] for sign in told)


def told(error: BaseException) -> str:
    """Kind, text and place of an error that is not palpate's own, on one line; the text may fail as well."""
    try:
        said = one_line(error)[:200]
    except Exception:
        said = "its text cannot be printed"
    place = raised_at(error)
    return f"{type(error).__name__}: {said}" + (f" ({place})" if place else "")


def raised_at(error: BaseException) -> str:
    """Return ``module.py:LINE`` of the third-party code that raised an error; empty where there is none.

    Of the calls on the way it is the innermost one in the package that comes first: a library that this package uses
    says nothing of its mistake.
    """
    place, package, trace = "", "", error.__traceback__
    while trace is not None:
        top = str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0]
        if top != "palpate" and top not in sys.stdlib_module_names:
            package = package or top
        if package and top == package:
            place = f"{os.path.basename(trace.tb_frame.f_code.co_filename)}:{trace.tb_lineno}"
        trace = trace.tb_next
    return place


def _shown(value: object) -> str:
    text = repr(value)
    # Both ends: of a long path the end says most.
    return text if len(text) <= 100 else f"{text[:48]}...{text[-48:]}"


def require_in(field: str, value: float, low: float, high: float) -> None:
    """The value must be a finite number of [low, high]."""
    if not isinstance(value, (int, float)) or not isfinite(value) or not low <= value <= high:
        raise ConfigurationError(field, value, f"a number from {low:g} to {high:g}")


def require_whole(field: str, value: int, low: int, high: int) -> None:
    """The value must be a whole number of [low, high]."""
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise ConfigurationError(field, value, f"a whole number from {low} to {high}")


def require_one_of(field: str, value: str, accepted: Sequence[str]) -> None:
    """The value must be one of the names."""
    if value not in accepted:
        raise ConfigurationError(field, value, f"one of {', '.join(accepted)}{did_you_mean(value, accepted)}")


def did_you_mean(value: object, accepted: Sequence[str]) -> str:
    """The nearest of the names, as the end of a sentence; empty where none is near, or the value is no text."""
    near = difflib.get_close_matches(value, accepted, n=1, cutoff=0.5) if isinstance(value, str) else []
    return f"; did you mean {near[0]}?" if near else ""
