"""What every arm keeps about coming to rest: its stops, from wherever and whenever they come, and what follows them."""

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from itertools import repeat
from threading import Thread
from types import FrameType
from typing import Any, Final

from palpate.core.errors import CommandError
from palpate.core.ports.contracts.arm_bench import (
    ArmBench,
    fast_steps,
    require_at,
    require_near,
    require_quiet_stop,
    shifted,
    where,
)
from palpate.core.ports.contracts.device import LONG_TICKS
from palpate.core.ports.contracts.lives import pass_time
from palpate.core.ports.contracts.rigs import ArmCommandRig
from palpate.core.ports.contracts.violations import knob, require
from palpate.core.ports.devices import Clock
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.values import CommandReason, JointCommand

_LOOKS: Final = 120
_JOIN_S: Final = 0.01
_MOMENTS: Final = 8
"""Of the lines of ``send``, about so many are tried, the last one always."""


class ArmStopContract(ArmBench):
    """The clauses on stops; those on commands are in :mod:`.arm_command`."""

    def test_stop_works_in_every_state(self) -> None:
        """``stop`` never raises, in whatever state the arm is, twice too, and does not wait for ever."""
        for life in (Life.CONSTRUCTED, Life.CONFIGURED, Life.ACTIVE, Life.CLOSED):
            self._check_stop(life)

    def test_stop_works_from_another_thread(self) -> None:
        """``stop`` works from any thread, while the loop goes on, and counts once it has returned."""
        with self._rig(Life.ACTIVE) as rig:
            raised: list[Exception] = []
            _run_beside(rig, raised)
            require("another thread", not raised, f"{raised}", "stop() not to raise")
            applied = self._send(rig, shifted(rig.home_rad, rig.step_rad))
            require("another thread", applied.reason is CommandReason.STOPPED, f"{applied}", "STOPPED")

    def test_stop_in_the_middle_of_send_is_not_overtaken(self) -> None:
        """A ``stop`` that comes while ``send`` is at work, as from a signal handler, holds the arm where it is."""
        with self._rig(Life.ACTIVE) as rig:
            lines = self._stop_at_line(rig, 0)
            for line in range(lines, 0, -max(1, lines // _MOMENTS)):
                self._stop_at_line(rig, line)

    def _stop_at_line(self, rig: ArmCommandRig, line: int) -> int:
        self._activate_again(rig)
        self._send(rig, rig.home_rad)
        rig.advance(rig.settle_ticks)
        before_rad, away_rad = where(rig), shifted(rig.home_rad, rig.step_rad)
        lines = _interrupted(partial(self._send, rig, away_rad), line, rig.device.stop, rig.clock)
        rig.advance(rig.settle_ticks)
        if 0 < line <= lines:
            require_near(rig, before_rad, f"stop() in line {line} of {lines} of send()")
        return lines

    def test_after_stop_send_applies_nothing(self) -> None:
        """After ``stop``, and another much later, ``send`` says STOPPED each time and does not apply what was asked."""
        with self._rig(Life.ACTIVE) as rig:
            for pause_ticks in (0, 1, LONG_TICKS):
                rig.advance(pause_ticks)
                rig.device.stop()
                self._swallow(rig)
            # Whatever the last command was: one to stay, a move, one that was cut short.
            hasty = fast_steps(rig)[:1] if rig.motion is None else []
            for last_rad in (rig.home_rad, shifted(rig.home_rad, rig.step_rad), *hasty):
                self._activate_again(rig)
                before_rad = () if rig.position_rad is None or rig.runs_by_itself else where(rig)
                self._send(rig, last_rad)
                rig.device.stop()
                if before_rad:
                    rig.advance(rig.settle_ticks)
                    require_near(rig, before_rad, f"stop() after the command {last_rad}")
                self._swallow(rig)

    def _swallow(self, rig: ArmCommandRig) -> None:
        """A stopped arm applies neither a move nor a command to stay, and a refused one changes nothing of that."""
        asked_rad = shifted(rig.home_rad, -rig.step_rad)
        for _ in range(2):
            applied = self._send(rig, asked_rad)
            stopped = applied.reason is CommandReason.STOPPED and applied.position_rad != asked_rad
            require("stopped", stopped, f"{applied}", "STOPPED, with the angles at which the arm is held")
            rig.advance(1)
            with suppress(CommandError):
                rig.device.send(JointCommand((*asked_rad, 0.0)))
        if rig.motion is None:
            applied = self._send(rig, applied.position_rad)
            require("stopped", applied.reason is CommandReason.STOPPED, f"{applied}", "STOPPED for that, too")

    def test_after_stop_the_arm_holds_still(self) -> None:
        """After ``stop``, that of a long run too, the arm stays where it came to rest, whatever is sent, for long."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.position_rad, "position_rad")
            rig.advance(rig.rest_ticks)
            self._send(rig, shifted(rig.home_rad, rig.step_rad))
            rig.device.stop()
            rig.advance(rig.settle_ticks)
            rest_rad = where(rig)
            for ticks in (rig.settle_ticks, *repeat(1, _LOOKS), rig.rest_ticks, rig.settle_ticks):
                self._send(rig, shifted(rest_rad, -rig.step_rad))
                rig.advance(ticks)
                require_at("stopped", rig, rest_rad)

    def test_stop_works_once_the_cable_is_cut(self) -> None:
        """When the connection is cut, ``stop`` does not raise, neither at once nor later."""
        with self._rig(Life.ACTIVE) as rig:
            knob(rig.disconnect, "disconnect")()
            for _ in range(2):
                require_quiet_stop(rig, "stop() not to raise when nobody answers")
                pass_time(rig, rig.patience_ns)

    def test_command_under_way_is_dropped(self) -> None:
        """``stop``, with a fault too, ``deactivate`` and ``close`` keep the arm where it is, not where it was sent."""
        for end in ("stop", "deactivate", "close", "stop with a fault"):
            with self._rig(Life.ACTIVE) as rig:
                if end == "stop with a fault" and rig.provoke_fault is None:
                    continue
                for again in range(2 if end == "stop" else 1):
                    if again:
                        self._activate_again(rig)
                    # Back home, where an arm could be that goes home by itself.
                    self._send(rig, shifted(rig.home_rad, rig.step_rad))
                    rig.advance(rig.settle_ticks)
                    before_rad = where(rig)
                    self._send(rig, rig.home_rad)
                    if end == "stop with a fault":
                        knob(rig.provoke_fault, "provoke_fault")()
                        before_rad = where(rig)
                    getattr(rig.device, end.split()[0])()
                    rig.advance(rig.settle_ticks)
                    require_near(rig, before_rad, end)
                rig.device.close()
                rig.advance(rig.settle_ticks)
                require_near(rig, before_rad, f"{end} and close")

    def test_stop_holds_the_pose_of_now(self) -> None:
        """Each ``stop`` holds the arm where it then is, and ``send`` says that pose; what it swallows stays so."""
        with self._rig(Life.ACTIVE) as rig:
            for side in (1.0, -1.0):
                self._go(rig, shifted(rig.home_rad, side * rig.step_rad))
                rig.advance(rig.settle_ticks)
                here_rad = where(rig)
                rig.device.stop()
                rig.advance(rig.settle_ticks)
                require_at("held", rig, here_rad)
                applied = self._send(rig, rig.home_rad)
                require_at("held", rig, here_rad, applied.position_rad)
                self._activate_again(rig)
                rig.advance(rig.settle_ticks)
                require_at("activated again", rig, here_rad)

    def test_motion_ends_and_does_not_resume(self) -> None:
        """After a stop, a pause or a fault the arm rests, and activated again, or closed, it does until commanded."""
        for end, closed in (("stop", False), ("deactivate", False), ("provoke_fault", False), ("provoke_fault", True)):
            with self._rig(Life.ACTIVE) as rig:
                act = getattr(rig, end, None) or getattr(rig.device, end, None)
                if act is None:
                    continue  # nothing provokes a fault here
                self._go(rig, shifted(rig.home_rad, rig.step_rad))
                rig.advance(rig.settle_ticks)
                self._send(rig, rig.home_rad)
                act()
                rig.advance(rig.settle_ticks)
                rest_rad = where(rig)
                rig.advance(max(LONG_TICKS, rig.settle_ticks) if rig.runs_by_itself else rig.rest_ticks)
                require_at(f"at rest after {end}", rig, rest_rad)
                if closed:
                    rig.device.close()
                else:
                    self._activate_again(rig)
                rig.advance(rig.settle_ticks)
                require_at(f"{'closed' if closed else 'activated'} after {end}", rig, rest_rad)

    def _check_stop(self, life: Life) -> None:
        with self._rig(life) as rig:
            before, was_open = rig.device.life, rig.is_open is not None and rig.is_open()
            for _ in range(2):
                require_quiet_stop(rig, f"stop() to work while {life.value}")
            require("stop", rig.device.life is before, f"{rig.device.life} after stop()", str(before))
            opened = rig.is_open is not None and rig.is_open() and not was_open
            require("stop", not opened, "a resource that it opened", "stop() to open nothing")


def _run_beside(rig: ArmCommandRig, raised: list[Exception]) -> None:
    """Stop the arm from a thread of its own."""

    def stop() -> None:
        try:
            rig.device.stop()
        except Exception as error:
            raised.append(error)

    thread = Thread(target=stop, name="a thread that stops", daemon=True)
    thread.start()
    thread.join(_JOIN_S)
    for _ in range(LONG_TICKS):
        if not thread.is_alive():
            return
        # What it waits for may come with time only.
        rig.advance(1)
        thread.join(_JOIN_S)
    require("another thread", False, f"it waits still after {LONG_TICKS} ticks", "stop() to return")


def _interrupted(action: Callable[[], object], line: int, act: Callable[[], object], clock: Clock) -> int:
    """Call something and, before one of its lines of Python, something else; returns how many lines there were.

    Not in the middle of the clock: that of a test may let threads take turns, and one that sleeps has none.
    """
    lines = 0

    def trace(frame: FrameType, event: str, argument: object) -> Any:
        nonlocal lines
        if event == "call" and _is_within(clock, frame):
            return None
        if event == "line":
            lines += 1
            if lines == line:
                act()
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        action()
    finally:
        sys.settrace(before)
    return lines


def _is_within(clock: Clock, frame: FrameType | None) -> bool:
    while frame is not None and frame.f_code is not _interrupted.__code__:
        if frame.f_locals.get("self") is clock:
            return True
        frame = frame.f_back
    return False
