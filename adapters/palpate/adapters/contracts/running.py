"""List and run the clauses of a suite without a test framework."""

import enum
from dataclasses import dataclass

from palpate.adapters.contracts.bench import ClauseNotApplicable, ContractViolation
from palpate.core.errors import ConfigurationError


class ClauseOutcome(enum.Enum):
    """The outcome of a clause."""

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
    """The result of one clause.

    Attributes:
        message: Why not, or why it could not be tried; empty when it passed.
    """

    clause: Clause
    outcome: ClauseOutcome
    message: str = ""


def clauses(suite_class: type) -> tuple[Clause, ...]:
    """Return the clauses of a suite, general ones first, in the order of the source."""
    names: dict[str, None] = {}
    for base in reversed(suite_class.__mro__):
        names.update(dict.fromkeys(name for name in vars(base) if name.startswith("test_")))
    return tuple(Clause(name, (getattr(suite_class, name).__doc__ or "").strip().split("\n\n")[0]) for name in names)


def run_clauses(suite: object) -> list[ClauseResult]:
    """Try every clause of a suite; each makes its own rig.

    Raises:
        ConfigurationError: It has no clauses, for instance because it is the class instead of an instance.
    """
    if not clauses(type(suite)):
        raise ConfigurationError("suite", suite, "an instance of a contract suite, such as MyClockContract()")
    results: list[ClauseResult] = []
    for clause in clauses(type(suite)):
        outcome, message = ClauseOutcome.FAILED, ""
        try:
            getattr(suite, clause.name)()
            outcome = ClauseOutcome.PASSED
        except ClauseNotApplicable as reason:
            outcome, message = ClauseOutcome.NOT_APPLICABLE, str(reason)
        except ContractViolation as violation:
            message = str(violation)
        except Exception as error:
            # An adapter may raise anything anywhere; the other clauses are still worth trying.
            message = f"it raised {type(error).__name__}: {error}"
        results.append(ClauseResult(clause, outcome, message))
    return results
