"""Tick delays in whole trials on a real-time clock, and the longest duration of each section of a tick.

    python -m benchmarks.jitter --seconds 600 --rig mujoco            the work cell in real time
    python -m benchmarks.jitter --seconds 600 --rig emulated --rt     emulated devices in another process

Run ``cyclictest`` to measure the floor of the machine.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from contextlib import ExitStack
from dataclasses import replace
from typing import Final

from benchmarks.emulated_rig import emulated_rig
from palpate.adapters.config import RealTimeConfig
from palpate.adapters.config.compose import scenario
from palpate.adapters.experiments.build import build_perception, build_task, task_actions
from palpate.adapters.experiments.trial import trial_setup
from palpate.adapters.hardware.approach import find_approach
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.real_time import RealTimeSession
from palpate.adapters.hardware.rig import HardwareRig
from palpate.adapters.mujoco.rig import SimulatedRig
from palpate.core.control_loop import run_trial
from palpate.core.errors import PalpateError
from palpate.core.policy import RandomWalkPolicy
from palpate.core.ports.devices import Clock, Ports
from palpate.core.ports.lifecycle import Life
from palpate.core.ports.rig import Rig
from palpate.core.ports.values import CONTROL_RATE_HZ
from palpate.core.tasks.insertion import InsertionTask
from palpate.core.trial import find_ready_pose
from palpate.simulation.work_cell.cell import WorkCell

_NS: Final = 1_000_000_000
_NOT_MADE_UP_NS: Final = _NS // 10
"""Delay of the physics above which it does not catch up, as after a pause between trials."""


class PacedClock(Clock):
    """Clock that sleeps in real time and advances the simulated cell accordingly.

    Times are on the scale of the cell, so they can be compared with the times of its samples. During a sleep, the
    physics advances to the last tick of the cell before the deadline.
    """

    def __init__(self, cell: WorkCell) -> None:
        self._cell, self._real = cell, MonotonicClock()
        self._offset_ns = cell.time_ns - self._real.now_ns()

    def now_ns(self) -> int:
        """See :class:`Clock`."""
        now = self._real.now_ns() + self._offset_ns
        if now < self._cell.time_ns:
            self._offset_ns += self._cell.time_ns - now
            return self._cell.time_ns
        return now

    def sleep_until(self, deadline_ns: int) -> None:
        """See :class:`Clock`."""
        cell, now = self._cell, self.now_ns()
        if now - cell.time_ns > _NOT_MADE_UP_NS:
            cell.set_ticks(_newest_tick(now))
        last = _newest_tick(deadline_ns)
        while cell.ticks < last:
            cell.advance()
        self._real.sleep_until(deadline_ns - self._offset_ns)


def _newest_tick(time_ns: int) -> int:
    """Return the latest tick of the cell whose time, rounded down to whole nanoseconds, is not after this time."""
    return ((time_ns + 1) * CONTROL_RATE_HZ - 1) // _NS


def run_trials(rig: Rig, ports: Ports, task: InsertionTask, session: RealTimeSession, seconds: float) -> Counter[str]:
    """Run trials until the time is over, and return the number of each outcome."""
    outcomes: Counter[str] = Counter()
    end_s, trial = time.monotonic() + seconds, 0
    while time.monotonic() < end_s:
        try:
            rig.prepare(trial)
            with session.loop():
                report = run_trial(task, ports, trial_setup(scenario("paper"), trial), None, (session.timer,))
            outcomes["none" if report.outcome is None else report.outcome.value] += 1
        except PalpateError as error:
            # The script is the person who has looked at it.
            outcomes[str(error)] += 1
            if rig.ports.arm.life is Life.FAULTED:
                rig.ports.arm.acknowledge_fault()
        trial += 1
    return outcomes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--rig", choices=("mujoco", "emulated"), default="mujoco")
    parser.add_argument("--arm", default="zebra-nmc", help="emulated arm")
    parser.add_argument("--force", default="jr3-can", help="emulated force sensor")
    parser.add_argument("--rt", action="store_true", help="request SCHED_FIFO, locked memory and frozen objects")
    parser.add_argument("--priority", type=int, default=50)
    parser.add_argument("--cpu", type=int, default=-1, help="with --rt: keep the loop on this CPU")
    options = parser.parse_args()
    requests = RealTimeConfig()
    if options.rt:
        requests = RealTimeConfig(True, options.priority, True, options.cpu, True)
    # Threads of the rig that keep the arm's cycles take the loop's priority.
    config = replace(scenario("paper"), real_time=requests)
    ready = find_ready_pose(config.arm, config.tool.geometry, config.task)
    task = build_task(config, ready, build_perception(config), RandomWalkPolicy(task_actions(config)))
    with ExitStack() as opened:
        session = opened.enter_context(RealTimeSession(requests))
        print(*session.grants, sep="\n")
        if options.rig == "mujoco":
            simulated = opened.enter_context(SimulatedRig(config, ready))
            ports = replace(simulated.ports, clock=PacedClock(simulated.cell))
            outcomes = run_trials(simulated, ports, task, session, options.seconds)
        else:
            file = opened.enter_context(emulated_rig(options.arm, options.force, 30 if options.rt else 0))
            hardware = opened.enter_context(HardwareRig(file, config, find_approach(config, ready)))
            outcomes = run_trials(hardware, hardware.ports, task, session, options.seconds)
    print(f"{outcomes.total()} trials: {dict(outcomes)}")
    print(session.report())


if __name__ == "__main__":
    main()
