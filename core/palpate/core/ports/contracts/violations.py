"""How a clause fails, and how one that cannot be tried is marked."""

from collections.abc import Callable
from re import findall
from typing import Final, TypeVar
from unittest import SkipTest

T = TypeVar("T")

_SAYS_NOTHING: Final = frozenset(
    "a an the of in on at by is was has had it its some any something general generic internal other undefined unknown"
    " error errors err fault faults faulted failure failures failed fail exception problem wrong bad went device arm"
    " sensor stopped none null code status".split()
)
"""Of these words alone no cause is made, nor of numbers."""


class ContractViolation(AssertionError):  # noqa: N818 - it reports a finding, like a failed assertion
    """An adapter does not keep a clause of its port's contract."""

    def __init__(self, clause: str, observed: str, wanted: str) -> None:
        self.clause, self.observed, self.wanted = clause, observed, wanted
        super().__init__(f"{clause}: observed {observed}; the contract wants {wanted}")


class ClauseNotApplicable(SkipTest):
    """The rig lacks a knob that the clause needs.

    A kind of :class:`unittest.SkipTest`, because pytest shows those as skipped; the suites themselves
    need no test framework.
    """


def knob(value: T | None, name: str) -> T:
    """The rig's optional knob.

    Raises:
        ClauseNotApplicable: The rig has no such knob.
    """
    if value is None:
        raise ClauseNotApplicable(f"this rig has no {name}")
    return value


def says_something(what: str) -> bool:
    """Whether a text says more than that something is wrong."""
    return any(word not in _SAYS_NOTHING for word in findall("[^\\W\\d_]+", what.lower()))


def require(clause: str, holds: bool, observed: str, wanted: str) -> None:
    """Fail the clause unless ``holds``.

    Raises:
        ContractViolation: It does not hold.
    """
    if not holds:
        raise ContractViolation(clause, observed, wanted)


def require_raises(
    clause: str,
    errors: type[Exception] | tuple[type[Exception], ...],
    action: Callable[[], object],
    wanted: str,
) -> Exception:
    """Fail the clause unless ``action`` raises one of ``errors``; gives the error.

    Raises:
        ContractViolation: It raises nothing, or something else.
    """
    try:
        result = action()
    except errors as error:
        return error
    except ClauseNotApplicable:
        raise
    except Exception as error:
        raise ContractViolation(clause, f"{type(error).__name__} ({error})", wanted) from error
    raise ContractViolation(clause, f"no error, but {result!r}", wanted)


def require_quiet(clause: str, action: Callable[[], object], wanted: str) -> None:
    """Fail the clause if ``action`` raises anything.

    Raises:
        ContractViolation: It raises.
    """
    try:
        action()
    except Exception as error:
        raise ContractViolation(clause, f"{type(error).__name__} ({error})", wanted) from error
