"""List and run the clauses of a suite without a test framework."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from palpate.core.errors import ConfigurationError
from palpate.core.ports.contracts.violations import ClauseNotApplicable, ContractViolation


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
        statement: What it wants, in one sentence.
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


def run_clauses(suite: object) -> list[ClauseResult]:
    """Try every clause of a suite; each makes its own rig.

    Raises:
        ConfigurationError: It has no clauses, so that nothing would be tried: the class instead of an instance, say.
    """
    if not clauses(type(suite)):
        raise ConfigurationError("suite", suite, "an instance of a contract suite, such as MyClockContract()")
    return [_run(suite, clause) for clause in clauses(type(suite))]


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
