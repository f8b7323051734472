"""An arm on the test bench: how its clauses command it, and what they look at."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from random import Random
from time import perf_counter_ns
from typing import ClassVar, Final

from typing_extensions import override

from palpate.core.errors import DeviceError
from palpate.core.ports.contracts.device import DeviceContract
from palpate.core.ports.contracts.lives import pass_time, replug, revive
from palpate.core.ports.contracts.motion import ramp
from palpate.core.ports.contracts.rigs import ArmCommandRig
from palpate.core.ports.contracts.violations import (
    ClauseNotApplicable,
    ContractViolation,
    knob,
    require,
    require_quiet,
)
from palpate.core.ports.devices import ArmCommand
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CONTROL_RATE_HZ, AppliedCommand, CommandReason, JointCommand, JointVector

_TICK_NS: Final = 10**9 // CONTROL_RATE_HZ
_MOVES: Final = 2
_SEED: Final = 22
_HANG_NS: Final = 500_000_000
"""So long no computer is late."""
_MANY_STEPS: Final = 1500
"""On a simulated arm a limit that is further away is left alone unless it is the nearest."""


class ArmBench(DeviceContract[ArmCommandRig]):
    """What the clauses of an arm have in common; every command goes through :meth:`_send`."""

    PORT: ClassVar[type] = ArmCommand

    _asked_rad: JointVector = ()
    _tick_rad: JointVector = ()
    _tick_ns: int = 0

    _late: int = 0
    _stopped: bool = False
    _caught: bool = False
    _from_rad: JointVector = ()
    _rest_rad: JointVector = ()
    _random: Random

    @override
    def use(self, rig: ArmCommandRig) -> object:
        return self._send(rig, rig.home_rad if rig.motion is None else standing(rig))

    @override
    def may_use(self, rig: ArmCommandRig) -> bool:
        return rig.motion is None or bool(rig.motion.rate_rad_s)

    @override
    def begun(self, rig: ArmCommandRig) -> None:
        self._stopped, self._asked_rad = False, ()  # a ramp begins where the arm stands

    @override
    def works(self, rig: ArmCommandRig) -> None:
        """Small moves, of one joint or some, lead to where they say; of a stopped arm they move nothing."""
        try:
            self._work(rig)
        except DeviceError:
            self._rest_rad = ()  # nobody knows how far it came
            raise

    def _work(self, rig: ArmCommandRig) -> None:
        for _ in range(_MOVES):
            asked_rad = self._somewhere(rig)
            if self._stopped:
                applied = self._send(rig, asked_rad)
                held = applied.reason is CommandReason.STOPPED and applied.position_rad != asked_rad
                require("stopped", held, f"{applied}", "STOPPED, with the angles at which the arm is held")
            else:
                applied = self._go(rig, asked_rad)
                asked = applied.reason is CommandReason.AS_ASKED and applied.position_rad == asked_rad
                require("each command", asked, f"{applied}", f"{asked_rad} with the reason AS_ASKED")
                self._rest_rad = asked_rad
            rig.advance(rig.settle_ticks)
            self.rests(rig)

    @override
    def busy(self, rig: ArmCommandRig) -> None:
        # One step, from rest: how far it goes on has to be told from where it was sent.
        joint = self._random.randrange(len(rig.home_rad))
        here_rad = self._rest_rad or rig.home_rad
        outward = here_rad[joint] <= rig.home_rad[joint] and here_rad[joint] + rig.step_rad <= rig.upper_rad[joint]
        self._send(rig, shifted(here_rad, rig.step_rad if outward else -rig.step_rad, joint))
        self._rest_rad, self._caught, self._from_rad = (), True, here_rad

    @override
    def upset(self, rig: ArmCommandRig) -> None:
        """A stop, which is for an active arm to remember."""
        for _ in range(self._random.randrange(1, 4)):
            require_quiet_stop(rig, f"stop() to work while {rig.device.life.value}")
        self._stopped = rig.device.life is Life.ACTIVE

    @override
    def rests(self, rig: ArmCommandRig) -> None:
        """The arm stands where it was last seen, or sent."""
        with suppress(ClauseNotApplicable):
            if not self._rest_rad:
                caught_rad = where(rig)
                rig.advance(rig.settle_ticks)
                self._rest_rad = where(rig)
                if self._caught and rig.device.life is not Life.FAULTED:
                    require_near(rig, caught_rad, "it was to stop")
                elif self._caught:
                    # It may arrive at its last set-point.
                    way_rad, most_rad = far(self._rest_rad, self._from_rad), 1.5 * rig.step_rad
                    require("fault", way_rad <= most_rad, f"a way of {way_rad} rad", f"{most_rad} rad at most")
                self._caught = False
            found_rad = where(rig)
            near = far(found_rad, self._rest_rad) <= rig.tolerance_rad
            require("rest", near, f"{found_rad} rad", f"{self._rest_rad} rad within {rig.tolerance_rad} rad")

    def _somewhere(self, rig: ArmCommandRig) -> JointVector:
        """A pose beside home, in which some joint stands elsewhere than now."""
        here_rad = self._rest_rad or rig.home_rad
        while True:
            ways = (self._random.choice((-1.0, -0.5, 0.0, 0.5, 1.0)) * rig.step_rad for _ in rig.home_rad)
            limits = zip(rig.home_rad, ways, rig.lower_rad, rig.upper_rad, strict=True)
            there_rad = tuple(min(max(q + way, lower), upper) for q, way, lower, upper in limits)
            if far(there_rad, here_rad) >= rig.step_rad:
                return there_rad

    @override
    @contextmanager
    def _rig(self, life: Life) -> Iterator[ArmCommandRig]:
        """Besides: an arm that somebody could stand beside goes home along a ramp before a clause, and after it."""
        self._late, self._stopped, self._caught = 0, False, False
        self._rest_rad, self._random = (), Random(_SEED)
        with super()._rig(life) as rig:
            self._asked_rad = ()
            may_move = rig.motion is not None and bool(rig.motion.rate_rad_s)
            if may_move and life is Life.ACTIVE:
                self._go(rig, rig.home_rad)
            try:
                yield rig
            finally:
                if may_move and rig.device.life is Life.ACTIVE:
                    # What a clause has found counts, not whether the way back was free; the next begins with a ramp.
                    with suppress(Exception):
                        self._go(rig, rig.home_rad)

    @staticmethod
    def plan(rig: ArmCommandRig) -> list[str]:
        """What the clauses would move within the rig's limits, how far and how fast; one line each."""
        motion = rig.motion
        if motion is None or not motion.rate_rad_s:
            return ["nothing: no command is sent to the arm"]
        lines = [
            f"at first and before each clause, from where the arm stands to home_rad, if no joint is more than"
            f" {motion.reach_rad:g} rad away from it",
            f"all {len(rig.home_rad)} joints by {rig.step_rad:.4g} rad to either side of home_rad",
        ]
        for joint, limit_rad, beyond_rad in limits_in_reach(rig):
            way = abs(beyond_rad - rig.home_rad[joint])
            if way <= motion.reach_rad:
                lines.append(f"joint {joint + 1} by {way:.4g} rad, to its limit at {limit_rad:g} rad and past it")
        return [*lines, f"all of it along ramps of at most {motion.rate_rad_s:g} rad/s a joint"]

    def _send(self, rig: ArmCommandRig, asked_rad: JointVector) -> AppliedCommand:
        """The one way by which clauses command the arm.

        Raises:
            ClauseNotApplicable: It would move further or faster than the rig allows.
        """
        motion = rig.motion
        if motion is None:
            return self._sent(rig, asked_rad)
        if not motion.rate_rad_s:
            raise ClauseNotApplicable("it sends commands to the arm")
        now_ns = rig.clock.now_ns()
        if not self._asked_rad or now_ns - self._tick_ns >= _TICK_NS:
            self._tick_rad, self._tick_ns = self._asked_rad or standing(rig), now_ns
        for way, most, what in (
            (far(asked_rad, self._tick_rad), motion.tick_rad, "within a tick"),
            (far(asked_rad, rig.home_rad), motion.reach_rad, "from home"),
        ):
            if way > most + rig.tolerance_rad:
                raise ClauseNotApplicable(f"it asks for {way:.4g} rad {what}, {most:.4g} rad are allowed")
        self._asked_rad = asked_rad
        return self._sent(rig, asked_rad)

    def _sent(self, rig: ArmCommandRig, asked_rad: JointVector) -> AppliedCommand:
        before_ns = rig.clock.now_ns()
        applied = rig.device.send(JointCommand(asked_rad))
        self._late += rig.clock.now_ns() - before_ns > rig.call_budget_ns
        return applied

    def _activate_again(self, rig: ArmCommandRig) -> None:
        revive(rig)
        self._asked_rad = ()  # a ramp begins where the arm stands

    def _live(self, rig: ArmCommandRig) -> None:
        """Stops, faults and a cut cable, twice each: an arm comes out of them with all limits that it had."""
        for _ in range(2):
            rig.device.stop()
            self._activate_again(rig)
            if rig.provoke_fault is not None:
                rig.provoke_fault()
                self._activate_again(rig)
            replug(rig)
            self._asked_rad = ()

    def _go(self, rig: ArmCommandRig, end_rad: JointVector, *, arrive: bool = True) -> AppliedCommand:
        """Lead the arm to a pose, step by step, a tick each but the last; what became of that.

        Args:
            arrive: Let that tick pass, too.
        """
        begin_rad = self._asked_rad or self._rest_rad or (rig.home_rad if rig.motion is None else standing(rig))
        applied = AppliedCommand(begin_rad)
        for asked_rad in ramp(begin_rad, end_rad, rig.step_rad):
            applied = self._send(rig, asked_rad)
            if arrive or asked_rad is not end_rad:
                pass_time(rig, _TICK_NS - 1)
        return applied


def limits_in_reach(rig: ArmCommandRig) -> list[tuple[int, float, float]]:
    """Joint, limit and an angle beyond it, the nearest first and all others that may be tried besides."""
    limits = zip(rig.home_rad, rig.lower_rad, rig.upper_rad, strict=True)
    rooms = sorted(
        (abs(limit_rad - q), joint, limit_rad, outward)
        for joint, (q, lower, upper) in enumerate(limits)
        for limit_rad, outward in ((lower, -1.0), (upper, 1.0))
    )
    most_rad = _MANY_STEPS * rig.step_rad if rig.motion is None else rig.motion.reach_rad - rig.step_rad
    return [
        (joint, limit_rad, limit_rad + outward * rig.step_rad)
        for k, (way_rad, joint, limit_rad, outward) in enumerate(rooms)
        if k == 0 or way_rad <= most_rad
    ]


def fast_steps(rig: ArmCommandRig) -> list[JointVector]:
    """Where the fast step leads, of each joint that has room for it, to either side, and of all these together."""
    limits = zip(rig.home_rad, rig.lower_rad, rig.upper_rad, strict=True)
    steps = {
        joint: [step for step in (rig.fast_step_rad, -rig.fast_step_rad) if lower <= q + step <= upper]
        for joint, (q, lower, upper) in enumerate(limits)
    }
    ends = [shifted(rig.home_rad, step, joint) for joint, each in steps.items() for step in each]
    if not ends:
        raise ContractViolation("rig", f"no room for {rig.fast_step_rad} rad", "a joint with room for fast_step_rad")
    together = (q + (steps[joint][0] if steps[joint] else 0.0) for joint, q in enumerate(rig.home_rad))
    return [*ends, tuple(together)]


def standing(rig: ArmCommandRig) -> JointVector:
    """Where the arm stands."""
    return knob(rig.position_rad, "position_rad, without which nobody knows where a ramp begins")()


def where(rig: ArmCommandRig) -> JointVector:
    """Where the joints stand, in whatever state the adapter is.

    Raises:
        ClauseNotApplicable: Nobody can tell.
    """
    position_rad = knob(rig.position_rad, "position_rad")
    try:
        return position_rad()
    except Exception as error:
        raise ClauseNotApplicable(f"position_rad cannot be read while {rig.device.life.value}: {error}") from error


def far(one_rad: JointVector, other_rad: JointVector) -> float:
    """The largest distance of a joint between two poses."""
    return max((abs(a - b) for a, b in zip(one_rad, other_rad, strict=True)), default=0.0)


def shifted(angles: JointVector, shift_rad: float, joint: int | None = None) -> JointVector:
    """The angles with one joint, or all of them, moved by ``shift_rad``."""
    return tuple(q + shift_rad if joint in (None, i) else q for i, q in enumerate(angles))


def require_near(rig: ArmCommandRig, before_rad: JointVector, after: str) -> None:
    """Fail the clause unless the arm, which was sent on by ``step_rad`` there, stayed."""
    way = far(where(rig), before_rad)
    wanted = f"less than half of the {rig.step_rad} rad on which it was sent just before"
    require("under way", way < 0.5 * rig.step_rad, f"{way} rad after {after}", wanted)


def require_quiet_stop(rig: ArmCommandRig, wanted: str) -> None:
    """Fail the clause unless ``stop`` returns within the rig's budget for it and raises nothing."""
    start_ns, wall_ns = rig.clock.now_ns(), perf_counter_ns()
    require_quiet("stop", rig.device.stop, wanted)
    spent_ns, budget_ns = rig.clock.now_ns() - start_ns, rig.stop_budget_ns
    require("stop", spent_ns <= budget_ns, f"{spent_ns} ns", f"at most {budget_ns} ns (stop_budget_ns)")
    wall_ns, budget_ns = perf_counter_ns() - wall_ns, max(budget_ns, _HANG_NS)
    require("stop", wall_ns <= budget_ns, f"{wall_ns} ns by the wall", f"at most {budget_ns} ns")


def require_at(clause: str, rig: ArmCommandRig, expected_rad: JointVector, told_rad: JointVector | None = None) -> None:
    """Fail the clause unless the joints stand there, or the arm says so, at rest."""
    found_rad, tolerance_rad = told_rad, 2.0 * rig.tolerance_rad
    if found_rad is None:
        found_rad, tolerance_rad = knob(rig.position_rad, "position_rad")(), rig.tolerance_rad
    near = len(found_rad) == len(expected_rad) and far(found_rad, expected_rad) <= tolerance_rad
    require(clause, near, f"{found_rad} rad", f"{expected_rad} rad within {tolerance_rad} rad")
