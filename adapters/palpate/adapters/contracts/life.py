"""Random sequences of requests to an adapter, checked against the table of :mod:`palpate.core.ports.lifecycle`.

The seeds are fixed, so the sequences are the same in every run.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from random import Random
from typing import Any, Final

from palpate.adapters.contracts.bench import ClauseNotApplicable, ContractViolation
from palpate.core.errors import DeviceError, FaultLatchedError, LifecycleError
from palpate.core.ports import TRANSITIONS, Life, LifeRequest

_ONWARD: Final = {
    Life.CONSTRUCTED: LifeRequest.CONFIGURE,
    Life.CONFIGURED: LifeRequest.ACTIVATE,
    Life.ACTIVE: LifeRequest.DEACTIVATE,
    Life.FAULTED: LifeRequest.ACKNOWLEDGE,
    Life.CLOSED: LifeRequest.CLOSE,
}
"""Request that leads to the next state of a normal life cycle."""
_STEPS: Final = ("go on", "go on", "work", "refuse", "disturb", "wait", "fail", "replug")
_LENGTH: Final = 40
_RECENT: Final = 8
"""Maximum number of steps listed in a message."""
_PAUSE_TICKS: Final = 200


def try_lives(suite: Any, lives: int) -> None:
    """Test a suite's adapter in a number of random life cycles.

    Raises:
        ContractViolation: A state differs from the table, or the adapter does not work.
    """
    for seed in range(lives):
        random = Random(seed)
        steps = [(random.choice(_STEPS), random.random() < 0.5) for _ in range(_LENGTH)]
        with suite.rig(Life.CONSTRUCTED) as rig:
            _Living(suite, rig).live(steps)


class _Living:
    """One life cycle of a newly constructed adapter, with its expected state after each step."""

    def __init__(self, suite: Any, rig: Any) -> None:
        self._suite, self._rig = suite, rig
        self._life, self._cause, self._steps = Life.CONSTRUCTED, "", list[str]()
        self._usable = suite.may_use()

    def live(self, steps: Sequence[tuple[str, bool]]) -> None:
        """Perform the steps, then close the device; some steps interrupt what the active device is doing."""
        self._look()
        for step, busy in (*steps, ("close", True), ("refuse", False)):
            self._step(step, busy)
            self._rig.advance(1)
            self._look()

    def _step(self, step: str, busy: bool) -> None:
        suite, rig = self._suite, self._rig
        active, used = self._life is Life.ACTIVE, self._life is Life.ACTIVE and self._usable
        if busy and used and step in ("go on", "disturb", "close"):
            self._try("start", partial(suite.start_work, rig))
        if step == "disturb":
            self._try("disturb", partial(suite.disturb, rig))
        elif step == "close":
            self._ask(LifeRequest.CLOSE)
        elif step == "fail" and active and rig.provoke_fault is not None:
            self._try("fault", rig.provoke_fault)
            self._faulted()
        elif step == "replug" and used and rig.disconnect is not None and rig.reconnect is not None:
            self._replug()
        elif step == "work" and used:
            self._try("work", partial(suite.work, rig))
        elif step in ("work", "refuse"):
            self._refuse()
        elif step == "wait":
            # An active arm may stop by itself if it receives no commands for a long time.
            rig.advance(1 if active else _PAUSE_TICKS)
        else:
            self._ask(_ONWARD[self._life])

    def _look(self) -> None:
        """Require that the state and the fault agree with the table, and that nothing moves."""
        life, fault = self._rig.device.life, self._rig.device.fault
        self._require(life is self._life, str(life), str(self._life))
        if life is not Life.CLOSED:
            self._require((fault or "") == self._cause, f"fault {fault!r}", repr(self._cause or None))
        self._try("", partial(self._suite.rest, self._rig))

    def _ask(self, request: LifeRequest) -> None:
        self._try(f"{request.value}()", getattr(self._rig.device, request.value))
        self._life, self._cause = TRANSITIONS[self._life, request], ""
        if self._life is Life.ACTIVE:
            self._suite.activated(self._rig)

    def _faulted(self) -> None:
        self._life, self._cause = Life.FAULTED, str(self._rig.device.fault or "")
        self._require(bool(self._cause), "a fault without a cause", "the cause of the fault in words")

    def _replug(self) -> None:
        """Disconnect and reconnect the cable; the only permitted effect is a fault."""
        rig = self._rig
        self._try("cut", rig.disconnect)
        rig.pass_time(rig.timeout_ns)
        with suppress(DeviceError):
            self._suite.use(rig)
        self._try("plug in", rig.reconnect)
        rig.pass_time(rig.timeout_ns)
        if rig.device.life is Life.FAULTED:
            self._faulted()

    def _refuse(self) -> None:
        """Require an error for every request that the state does not allow."""
        device = self._rig.device
        refused = {r.value: getattr(device, r.value) for r in LifeRequest if (self._life, r) not in TRANSITIONS}
        if self._life is not Life.ACTIVE and self._usable:
            refused["reading or sending"] = partial(self._suite.use, self._rig)
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
            raise ContractViolation(clause, observed, wanted)
