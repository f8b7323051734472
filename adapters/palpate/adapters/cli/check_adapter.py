"""``palpate check-adapter``."""

import signal
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, Final

from palpate.adapters.cli.options import CheckAdapterOptions
from palpate.adapters.config import from_here, imported
from palpate.adapters.hardware import MonotonicClock
from palpate.core.errors import ConfigurationError
from palpate.core.ports import CONTROL_RATE_HZ, ArmCommand, Clock, ForceSensor, JointEncoder
from palpate.core.ports.contracts import (
    NO_MOTION,
    ArmCommandContract,
    ArmCommandRig,
    ClauseOutcome,
    ClauseOverdueError,
    ClauseResult,
    ClockContract,
    ClockRig,
    DeviceContract,
    ForceSensorContract,
    ForceSensorRig,
    JointEncoderContract,
    JointEncoderRig,
    MotionLimits,
    run_clauses,
)

_CONTRACTS: Final[dict[type, type]] = {
    ForceSensorRig: ForceSensorContract,
    JointEncoderRig: JointEncoderContract,
    ArmCommandRig: ArmCommandContract,
    ClockRig: ClockContract,
}
_ACCEPTED: Final = (
    "package.module:Name, where Name is a contract suite with its make(), a function that makes a rig, or a force"
    " sensor or clock that can be made without arguments"
)
_MAX_AGE_NS: Final = 100_000_000
_PATIENCE_S: Final = 60.0
"""How long a clause may take on an arm that does not move."""


def find_suite(name: str) -> tuple[str, object]:
    """The port's name and the contract suite, ready to be run, for what a name leads to."""
    found = imported("adapter", name, _ACCEPTED)
    if isinstance(found, type):
        contract = next((c for c in _CONTRACTS.values() if issubclass(found, c)), None)
        if contract is not None:
            return _port(contract), _made(name, found)
    if not callable(found):
        raise ConfigurationError("adapter", name, _ACCEPTED)
    first = _made(name, found)
    contract = _CONTRACTS.get(type(first))
    if contract is not None:
        return _port(contract), _suite(contract, found)
    return _bare(name, found, first)


def check(
    name: str, motion: MotionLimits = NO_MOTION, tell: Callable[[list[str]], object] | None = None
) -> tuple[str, list[ClauseResult]]:
    """The port's name, and what became of each clause of its contract.

    As with ``python -m``, what lies in the current folder can be named.
    """
    with from_here():
        port, suite = find_suite(name)
        if isinstance(suite, DeviceContract):
            suite.motion = motion
            rig = suite.make().within(motion)
            if tell is not None and isinstance(suite, ArmCommandContract) and isinstance(rig, ArmCommandRig):
                tell(suite.plan(rig))
            rig.dispose()
        return port, run_clauses(suite, lambda clause: run_within(_patience_s(motion), clause))


def run_within(seconds: float, clause: Callable[[], None]) -> None:
    """Run a clause; raise ClauseOverdueError in one that takes longer, and each second again while it does not end."""
    # In place and by a signal, not in a thread that goes on: on the way out the rig's arm is stopped and closed.
    if threading.current_thread() is not threading.main_thread():
        clause()
        return

    def interrupt(*_: object) -> None:
        raise ClauseOverdueError(f"it was not done after {seconds:g} s, something blocks")

    handler = signal.signal(signal.SIGALRM, interrupt)
    others = signal.setitimer(signal.ITIMER_REAL, seconds, 1.0)
    try:
        clause()
    finally:
        signal.setitimer(signal.ITIMER_REAL, *others)
        signal.signal(signal.SIGALRM, handler)


def _made(name: str, maker: Callable[[], Any]) -> Any:
    try:
        return maker()
    except Exception as error:
        raise ConfigurationError("adapter", name, f"{_ACCEPTED}; calling it failed: {error!r}") from error


def _suite(contract: type, maker: Callable[[], Any]) -> object:
    made: object = type(f"Checked{contract.__name__}", (contract,), {"make": lambda self: maker()})()
    return made


def _bare(name: str, maker: Callable[[], Any], first: Any) -> tuple[str, object]:
    """A rig with no knobs: many clauses do not apply, but the life cycle and the samples are tried."""
    if isinstance(first, ForceSensor):
        return "ForceSensor", _suite(ForceSensorContract, lambda: _bare_sensor(maker()))
    if isinstance(first, (JointEncoder, ArmCommand)):
        accepted = "a function that makes a rig: where the arm stands at first, and its limits, must be known"
        raise ConfigurationError("adapter", name, accepted)
    if isinstance(first, Clock):
        return "Clock", _suite(ClockContract, lambda: ClockRig(clock=maker(), tolerance_ns=_MAX_AGE_NS))
    raise ConfigurationError("adapter", name, _ACCEPTED)


def _bare_sensor(device: ForceSensor) -> ForceSensorRig:
    return ForceSensorRig(
        device=device,
        clock=MonotonicClock(),
        advance=lambda ticks: time.sleep(ticks / CONTROL_RATE_HZ),
        max_age_ns=_MAX_AGE_NS,
        runs_by_itself=True,
    )


def _port(contract: type) -> str:
    return contract.__name__.removesuffix("Contract")


def _patience_s(motion: MotionLimits) -> float:
    """How long a clause may take: those that move go to many limits, and home before and after each."""
    rate, reach = motion.rate_rad_s, motion.reach_rad
    return _PATIENCE_S if not rate else 5.0 * _PATIENCE_S + 50.0 * reach / rate


def _tell(plan: list[str]) -> None:
    sys.stdout.write("what will move:\n" + "".join(f"  {line}\n" for line in plan))
    sys.stdout.flush()


def check_adapter(options: CheckAdapterOptions) -> int:
    """Try the contract and print clause by clause; 0 if every clause that applies is kept, else 1."""
    motion = MotionLimits(options.rate_rad_s, options.reach_rad) if options.moves else NO_MOTION
    port, results = check(options.adapter, motion, _tell)
    sys.stdout.write(f"{options.adapter}: the contract of {port}, {len(results)} clauses\n")
    width = max(len(outcome.value) for outcome in ClauseOutcome)
    for result in results:
        sys.stdout.write(f"  {result.outcome.value:{width}}  {result.clause.statement}\n")
        if result.outcome is not ClauseOutcome.PASSED:
            sys.stdout.write(f"  {'':{width}}    {result.message}\n")
    counts = {outcome: sum(result.outcome is outcome for result in results) for outcome in ClauseOutcome}
    sys.stdout.write(", ".join(f"{count} {outcome.value}" for outcome, count in counts.items()) + "\n")
    return 1 if counts[ClauseOutcome.FAILED] else 0
