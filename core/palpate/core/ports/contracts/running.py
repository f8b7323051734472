"""List and run the clauses of a suite without a test framework."""

import enum
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from palpate.core.errors import ConfigurationError
from palpate.core.ports.contracts.violations import ClauseNotApplicable, ContractViolation

PATIENCE_S: Final = 60.0
"""How long a clause may take on an arm that does not move."""


class _OverdueError(BaseException):
    """A clause takes too long; no adapter catches it on its way out."""


class ClauseOutcome(enum.Enum):
    """What became of a clause."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True, slots=True)
class Clause:
    """One clause of a contract.

    Attributes:
        name: Name of the method that tries it.
        statement: What it demands, in one sentence.
    """

    name: str
    statement: str


@dataclass(frozen=True, slots=True)
class ClauseResult:
    """What became of one clause.

    Attributes:
        message: Why not, or why it could not be tried; empty when it passed.
    """

    clause: Clause
    outcome: ClauseOutcome
    message: str = ""


def clauses(suite_class: type) -> tuple[Clause, ...]:
    """The clauses of a suite, general ones first, in the order in which they are written."""
    names: dict[str, None] = {}
    for base in reversed(suite_class.__mro__):
        names.update(dict.fromkeys(name for name in vars(base) if name.startswith("test_")))
    return tuple(Clause(name, _statement(getattr(suite_class, name))) for name in names)


def run_clauses(suite: object, patience_s: float = PATIENCE_S) -> list[ClauseResult]:
    """Try every clause of a suite; each makes its own rig.

    Args:
        patience_s: How long a clause may take; after one that took longer no other is tried. Kept in the main thread
            only, and where signals can interrupt.

    Raises:
        ConfigurationError: It has no clauses, so that nothing would be tried: the class instead of an instance, say.
    """
    if not clauses(type(suite)):
        raise ConfigurationError("suite", suite, "an instance of a contract suite, such as MyClockContract()")
    results: list[ClauseResult] = []
    for clause in clauses(type(suite)):
        try:
            with _interrupted_after(patience_s):
                results.append(_run(suite, clause))
        except _OverdueError:
            message = f"it was not done after {patience_s:g} s, something blocks; no clause after it was tried"
            results.append(ClauseResult(clause, ClauseOutcome.FAILED, message))
            break
    return results


@contextmanager
def _interrupted_after(seconds: float) -> Iterator[None]:
    """Raise _OverdueError in what takes longer, and each second again while it does not end."""
    # In place and by a signal, not in a thread that goes on: on the way out the rig's arm is stopped and closed.
    if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
        yield
        return

    def interrupt(*_: object) -> None:
        raise _OverdueError

    handler = signal.signal(signal.SIGALRM, interrupt)
    others = signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, *others)
        signal.signal(signal.SIGALRM, handler)


def _run(suite: object, clause: Clause) -> ClauseResult:
    try:
        getattr(suite, clause.name)()
    except ClauseNotApplicable as reason:
        return ClauseResult(clause, ClauseOutcome.NOT_APPLICABLE, str(reason))
    except ContractViolation as violation:
        return ClauseResult(clause, ClauseOutcome.FAILED, str(violation))
    except Exception as error:
        # A stranger's adapter may raise anything anywhere; the other clauses are still worth trying.
        return ClauseResult(clause, ClauseOutcome.FAILED, f"it raised {type(error).__name__}: {error}")
    return ClauseResult(clause, ClauseOutcome.PASSED)


def _statement(method: object) -> str:
    return (getattr(method, "__doc__", None) or "").strip().split("\n\n")[0]
