"""Lives of an adapter in any order of requests, against the table of :mod:`palpate.core.ports.lifecycle`.

Hypothesis draws the steps, from a fixed seed, and shortens those that fail.
"""

from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import partial
from math import inf
from time import perf_counter
from typing import Any, ClassVar, Final

from palpate.adapters.contracts.bench import ClauseNotApplicable, ContractViolation
from palpate.core.errors import DeviceError, FaultLatchedError, LifecycleError, UsageError
from palpate.core.ports import TRANSITIONS, Life, LifeRequest

try:
    from hypothesis import HealthCheck, Phase, Verbosity, settings
    from hypothesis import strategies as st
    from hypothesis.errors import Flaky
    from hypothesis.stateful import RuleBasedStateMachine, invariant, rule, run_state_machine_as_test
except ModuleNotFoundError as missing:
    raise UsageError("contract suites need hypothesis; install it with: pip install 'palpate[check]'") from missing

ONWARD: Final = {
    Life.CONSTRUCTED: LifeRequest.CONFIGURE,
    Life.CONFIGURED: LifeRequest.ACTIVATE,
    Life.ACTIVE: LifeRequest.DEACTIVATE,
    Life.FAULTED: LifeRequest.ACKNOWLEDGE,
    Life.CLOSED: LifeRequest.CLOSE,
}
"""The request that leads on to the next trial."""

_STEPS: Final = 40
_BEFORE_CLOSE: Final = 20
_RECENT: Final = 8
"""Steps in a message."""
_PAUSE_TICKS: Final = 200
_SHORTEN_S: Final = 5.0
"""How long steps that fail are shortened."""


def try_lives(suite: Any, lives: int, *, shrink: bool) -> None:
    """Live through a number of lives of a suite's adapter.

    Raises:
        ContractViolation: In one of them something differs from the table, or the adapter does not work.
    """
    found: list[tuple[int, ContractViolation]] = []
    options = settings(
        max_examples=lives,
        stateful_step_count=_STEPS,
        phases=(Phase.generate, Phase.shrink) if shrink else (Phase.generate,),
        derandomize=True,
        database=None,
        deadline=None,
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
        verbosity=Verbosity.quiet,
    )
    try:
        run_state_machine_as_test(type("Life", (LifeMachine,), {"suite": suite, "found": found}), settings=options)
    except (Flaky, ContractViolation):
        if not found:
            raise
        raise min(found, key=lambda failure: failure[0])[1] from None


class LifeMachine(RuleBasedStateMachine):
    """An adapter that was just constructed, and what must be true of it after each step."""

    suite: ClassVar[Any]
    found: ClassVar[list[tuple[int, ContractViolation]]]
    """How many steps it took, and what was found."""
    first_s: ClassVar[float] = inf
    """When the first violation was found."""

    def __init__(self) -> None:
        super().__init__()
        self._over = perf_counter() > self.first_s + _SHORTEN_S
        self._stack = ExitStack()
        self._rig = self._stack.enter_context(self.suite.rig(Life.CONSTRUCTED))
        self._life, self._cause, self._steps = Life.CONSTRUCTED, "", list[str]()
        self._usable = self.suite.may_use(self._rig)

    # One rule: of several Hypothesis leaves out some in each life.
    @rule(step=st.sampled_from(("go on", "go on", "work", "refuse", "disturb", "wait", "fail", "replug", "close")),
          busy=st.booleans())  # fmt: skip
    def step(self, step: str, busy: bool) -> None:
        """Take a step; some end what is under way in the active device."""
        active, rig = self._life is Life.ACTIVE, self._rig
        if self._over:
            return
        if busy and active and self._usable and step in ("go on", "disturb", "close"):
            self._try("start", partial(self.suite.start_work, rig))
        if step == "disturb":
            self._try("disturb", partial(self.suite.disturb, rig))
        elif step == "close" and len(self._steps) >= _BEFORE_CLOSE:
            self._ask(LifeRequest.CLOSE)
        elif step == "fail" and active and rig.provoke_fault is not None:
            self._try("fault", rig.provoke_fault)
            self._faulted()
        elif step == "replug" and active and self._usable and rig.disconnect is not None and rig.reconnect is not None:
            self._replug()
        elif step == "work" and active and self._usable:
            self._try("work", partial(self.suite.work, rig))
        elif step in ("work", "refuse"):
            self._refuse()
        elif step == "wait":
            # An active arm may stop by itself where commands stay away for long.
            rig.advance(1 if active else _PAUSE_TICKS)
        else:
            self._ask(ONWARD[self._life])
        rig.advance(1)

    @invariant()
    def look(self) -> None:
        """State and fault are those of the table, and nothing moves."""
        if self._over:
            return
        life, fault = self._rig.device.life, self._rig.device.fault
        self._require(life is self._life, str(life), str(self._life))
        if life is not Life.CLOSED:
            self._require((fault or "") == self._cause, f"fault {fault!r}", repr(self._cause or None))
        self._try("", partial(self.suite.rest, self._rig))

    def teardown(self) -> None:
        """Release the rig."""
        self._stack.close()

    def _ask(self, request: LifeRequest) -> None:
        self._try(f"{request.value}()", getattr(self._rig.device, request.value))
        self._life, self._cause = TRANSITIONS[self._life, request], ""
        if self._life is Life.ACTIVE:
            self.suite.activated(self._rig)

    def _faulted(self) -> None:
        self._life, self._cause = Life.FAULTED, str(self._rig.device.fault or "")
        self._require(bool(self._cause), "a fault without a cause", "the cause of the fault in words")

    def _replug(self) -> None:
        """Cut the cable and plug it in again; only a fault may come of that."""
        rig = self._rig
        self._try("cut", rig.disconnect)
        rig.pass_time(rig.patience_ns)
        with suppress(DeviceError):
            self.suite.use(rig)
        self._try("plug in", rig.reconnect)
        rig.pass_time(rig.patience_ns)
        if rig.device.life is Life.FAULTED:
            self._faulted()

    def _refuse(self) -> None:
        """Ask for all that the state does not allow."""
        device = self._rig.device
        refused = {r.value: getattr(device, r.value) for r in LifeRequest if (self._life, r) not in TRANSITIONS}
        if self._life is not Life.ACTIVE and self._usable:
            refused["reading or sending"] = partial(self.suite.use, self._rig)
        for what, action in refused.items():
            latched = self._life is Life.FAULTED and what in ("activate", "reading or sending")
            kinds = (FaultLatchedError,) if latched else (LifecycleError, FaultLatchedError)
            try:
                observed = f"no error, but {action()!r}"
            except kinds as error:
                cause = getattr(error, "cause", self._cause)
                observed = "" if cause == self._cause else f"the cause {cause!r}"
            except Exception as error:
                observed = repr(error)
            self._require(not observed, observed, f"{kinds[0].__name__} for {what} while {self._life.value}")

    def _try(self, step: str, action: Callable[[], object]) -> None:
        self._steps += [step] if step else []
        try:
            action()
        except ClauseNotApplicable:
            raise
        except ContractViolation as error:
            self._require(False, error.observed, error.wanted)
        except Exception as error:
            self._require(False, f"{type(error).__name__} ({error})", f"{step} to work")

    def _require(self, holds: bool, observed: str, wanted: str) -> None:
        if not holds:
            clause = f"life ({', '.join(self._steps[-_RECENT:]) or 'constructed'})"
            violation = ContractViolation(clause, observed, wanted)
            self.found.append((len(self._steps), violation))
            type(self).first_s = min(self.first_s, perf_counter())
            raise violation
