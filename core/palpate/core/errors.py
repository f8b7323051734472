"""Hierarchy of all errors that palpate raises deliberately.

::

    PalpateError
    ├── ConfigurationError          a setting is wrong; the operator fixes it
    │   ├── AssetError              a robot description or mesh is missing
    │   ├── DeviceSettingError      a device cannot be used with its settings
    │   └── UnreachableError        the arm cannot reach a pose
    ├── UsageError                  a command line is invalid; the operator fixes it
    ├── OutputError                 writing would overwrite existing results
    ├── LogError                    a recorded trial cannot be read or replayed
    ├── LifecycleError              a port was used in the wrong order; the caller is at fault
    ├── CommandError                a command must not be sent to any arm; the caller is at fault
    ├── UndeterminedError           a quantity cannot be determined from the measurements; measure more
    ├── PolicyError                 a third-party policy failed; its author fixes it
    └── DeviceError                 a device failed
        └── FaultLatchedError       a fault has not been acknowledged

Each error reports what happened, the offending value, and the accepted values.
"""

import os
import sys
from collections.abc import Sequence
from math import isfinite


class PalpateError(Exception):
    """Base class for all palpate errors; instances can be pickled."""

    def __reduce__(self) -> tuple[object, ...]:
        return _restored, (type(self), self.args, self.__dict__)


def _restored(kind: type[PalpateError], args: tuple[object, ...], attributes: dict[str, object]) -> PalpateError:
    """Rebuild an error without calling its constructor, whose arguments are not stored."""
    error = kind.__new__(kind, *args)
    error.__dict__.update(attributes)
    return error


class ConfigurationError(PalpateError, ValueError):
    """A setting cannot be used."""

    def __init__(self, field: str, value: object, accepted: str) -> None:
        self.field, self.value, self.accepted = field, value, accepted
        if accepted.startswith("no "):
            text = f"{field} = {_shown(value)}: {accepted}"
        elif value == "":
            text = f"{field} is missing; it must be {accepted}"
        else:
            text = f"{field} must be {accepted} (got {_shown(value)})"
        super().__init__(text)


class AssetError(ConfigurationError):
    """A robot description or one of its files is missing."""


class DeviceSettingError(ConfigurationError):
    """A device cannot be used with its settings."""

    def __init__(self, device: str, problem: str) -> None:
        super().__init__(device, problem, "")
        self.args = (f"{device}: {problem}",)


class UnreachableError(ConfigurationError):
    """No joint configuration within the limits reaches the pose."""


class UsageError(PalpateError):
    """A command line is invalid."""


class OutputError(PalpateError):
    """Writing would overwrite results or mix them with others."""

    def __init__(self, path: str, problem: str, remedy: str) -> None:
        self.path = path
        super().__init__(f"{path}: {problem}; {remedy}")


class LogError(PalpateError):
    """A recorded trial cannot be used.

    Attributes:
        where: Offset, message or tick; empty if the whole file is affected.
    """

    def __init__(self, path: str, where: str, problem: str, remedy: str) -> None:
        self.path, self.where = path, where
        super().__init__(f"{path}: {where + ': ' if where else ''}{problem}; {remedy}")


class LifecycleError(PalpateError, RuntimeError):
    """A request is not allowed in a port's current state."""

    def __init__(self, who: str, state: str, request: str, accepted: str) -> None:
        self.state, self.request = state, request
        super().__init__(f"{who}: {request} is not possible while {state}; {accepted}")


class CommandError(PalpateError, ValueError):
    """A command must not be sent to any arm, for example because it is not finite."""

    def __init__(self, problem: str, value: object) -> None:
        self.value = value
        super().__init__(f"{problem}: {_shown(value)}")


class UndeterminedError(PalpateError):
    """A quantity cannot be determined from the measurements."""

    def __init__(self, quantity: str, problem: str, missing: str) -> None:
        self.quantity = quantity
        super().__init__(f"{quantity} is not determined: {problem}; what is missing: {missing}")


class PolicyError(PalpateError, RuntimeError):
    """A third-party policy failed or returned an invalid value. The arm is always stopped.

    Attributes:
        policy: The class or factory, ``package.module:Name``.
    """

    def __init__(self, policy: str, problem: str) -> None:
        self.policy = policy
        super().__init__(f"policy {policy}: {problem}; the fault is in the policy")


class DeviceError(PalpateError, RuntimeError):
    """A device, or the connection to it, failed."""

    def __init__(self, device: str, problem: str) -> None:
        self.device, self.fault = device, f"{device}: {problem}"
        super().__init__(self.fault)


class FaultLatchedError(DeviceError):
    """The device stopped after a fault; a person must acknowledge it."""

    def __init__(self, device: str, cause: str, remedy: str = "acknowledge it first") -> None:
        super().__init__(device, f"stopped by a fault ({cause}); {remedy}")
        self.cause, self.fault = cause, f"{device}: {cause}"


def one_line(said: object) -> str:
    """Return an object's text on one line, with unprintable characters escaped."""
    text = " ".join(str(said).split())
    return "".join(sign if sign.isprintable() else ascii(sign)[1:-1] for sign in text)


def describe(error: BaseException) -> str:
    """Return the type, text and location of a third-party error on one line, even if formatting its text fails."""
    try:
        said = one_line(error)[:200]
    except Exception:
        said = "its text cannot be printed"
    place = raised_at(error)
    return f"{type(error).__name__}: {said}" + (f" ({place})" if place else "")


def raised_at(error: BaseException) -> str:
    """Return ``module.py:LINE`` for the third-party code that raised an error; empty if there is none.

    This is the innermost frame of the first third-party package in the traceback. Libraries used by that package are
    skipped.
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
    # In TOML and on the command line a vector is a list.
    text = repr(list(value) if isinstance(value, tuple) else value)
    # Keep both ends, because the end of a long path is the most informative.
    return text if len(text) <= 100 else f"{text[:48]}...{text[-48:]}"


def require_in(field: str, value: float, low: float, high: float) -> None:
    """Require a finite number in [low, high]."""
    if not isinstance(value, (int, float)) or not isfinite(value) or not low <= value <= high:
        raise ConfigurationError(field, value, f"a number from {low:g} to {high:g}")


def require_whole(field: str, value: int, low: int, high: int) -> None:
    """Require an integer in [low, high]."""
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise ConfigurationError(field, value, f"a whole number from {low} to {high}")


def require_one_of(field: str, value: str, accepted: Sequence[str]) -> None:
    """Require one of the accepted names."""
    if value not in accepted:
        raise ConfigurationError(field, value, f"one of {', '.join(accepted)}{did_you_mean(value, accepted)}")


def did_you_mean(value: object, accepted: Sequence[str]) -> str:
    """Return a suggestion to append to a message; empty if no name is similar or the value is not a string."""
    # Imported here, like other slow modules of the standard library, so that ``palpate --help`` starts quickly.
    import difflib

    near = difflib.get_close_matches(value, accepted, n=1, cutoff=0.5) if isinstance(value, str) else []
    return f"; did you mean {near[0]}?" if near else ""
