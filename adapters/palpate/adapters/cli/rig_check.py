"""``palpate rig check``."""

import signal
import sys
from collections.abc import Callable
from typing import Any, Final

from palpate.adapters.cli.options import CheckOptions
from palpate.adapters.config import from_here, imported
from palpate.adapters.contracts import (
    NO_MOTION,
    ArmCommandContract,
    ArmCommandRig,
    ClauseOutcome,
    ClauseOverdueError,
    ClauseResult,
    ClockContract,
    DeviceContract,
    MotionLimits,
    run_clauses,
)
from palpate.core.errors import ConfigurationError

_ACCEPTED: Final = "package.module:Name of a contract suite with its make(), such as a class from ForceSensorContract"
_PATIENCE_S: Final = 60.0
"""How long a clause may take on an arm that does not move."""


def check(options: CheckOptions) -> int:
    """Try the contract and print clause by clause; 0 if every clause that applies is kept, else 1."""
    motion = MotionLimits(options.rate_rad_s, options.reach_rad) if options.moves else NO_MOTION
    # As with python -m, modules in the current folder can be named.
    with from_here():
        suite = _suite(options.suite)
        if isinstance(suite, DeviceContract):
            suite.motion = motion
        if isinstance(suite, ArmCommandContract):
            _print_plan(suite, suite.make().within(motion))
        results = run_clauses(suite, lambda clause: run_within(_patience_s(motion), clause))
    _print_results(options.suite, results)
    if isinstance(suite, ArmCommandContract) and not options.moves:
        sys.stdout.write("next: --moves --rate-rad-s RATE --reach-rad REACH tries the clauses that move the arm\n")
    return int(any(result.outcome is ClauseOutcome.FAILED for result in results))


def run_within(seconds: float, clause: Callable[[], None]) -> None:
    """Run a clause; raise ClauseOverdueError in one that takes longer, and each second again while it does not end."""

    # In place and by a signal: on the way out the rig's arm is stopped and closed.
    def interrupt(*_: object) -> None:
        raise ClauseOverdueError(f"it was not done after {seconds:g} s, something blocks")

    handler = signal.signal(signal.SIGALRM, interrupt)
    others = signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)
    try:
        clause()
    finally:
        signal.setitimer(signal.ITIMER_REAL, *others)
        signal.signal(signal.SIGALRM, handler)


def _suite(name: str) -> DeviceContract[Any] | ClockContract:
    found = imported("suite", name, _ACCEPTED)
    if not isinstance(found, type) or not issubclass(found, (DeviceContract, ClockContract)):
        raise ConfigurationError("suite", name, _ACCEPTED)
    try:
        return found()
    except Exception as error:
        raise ConfigurationError("suite", name, f"{_ACCEPTED}; calling it failed: {error!r}") from error


def _print_plan(suite: ArmCommandContract, rig: ArmCommandRig) -> None:
    plan = suite.plan(rig)
    rig.dispose()
    sys.stdout.write("what will move:\n" + "".join(f"  {line}\n" for line in plan))
    sys.stdout.flush()


def _print_results(name: str, results: list[ClauseResult]) -> None:
    sys.stdout.write(f"{name}: {len(results)} clauses\n")
    width = max(len(outcome.value) for outcome in ClauseOutcome)
    for result in results:
        sys.stdout.write(f"  {result.outcome.value:{width}}  {result.clause.statement}\n")
        if result.outcome is not ClauseOutcome.PASSED:
            sys.stdout.write(f"  {'':{width}}    {result.message}\n")
    counts = {outcome: sum(result.outcome is outcome for result in results) for outcome in ClauseOutcome}
    sys.stdout.write(", ".join(f"{count} {outcome.value}" for outcome, count in counts.items()) + "\n")


def _patience_s(motion: MotionLimits) -> float:
    """How long a clause may take: those that move go to many limits, and home before and after each."""
    rate, reach = motion.rate_rad_s, motion.reach_rad
    return _PATIENCE_S if not rate else 5.0 * _PATIENCE_S + 50.0 * reach / rate
