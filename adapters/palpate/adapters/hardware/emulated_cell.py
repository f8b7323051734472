"""Simulated work cell with emulated devices, which clients access through serial ports and sockets."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from operator import sub
from typing import Final, Self

import numpy as np

from palpate.adapters.config import RIG_FORMAT, ZEBRA, EmulationConfig, RunConfig, literal, to_toml
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.emulated_devices import emulated_arm, emulated_sensor
from palpate.adapters.hardware.emulated_events import PlannedEvent
from palpate.core.job import Job
from palpate.core.motion import Kinematics, arm_named
from palpate.core.ports import CONTROL_RATE_HZ, GroundTruth, JointVector
from palpate.core.trial import ReadyPose, goal_in_base, wander_m
from palpate.simulation.emulators.motors import HOME_RAD
from palpate.simulation.work_cell import HiddenValues, WorkCell

_NS: Final = 1_000_000_000
_INSERTED_M: Final = 5e-5
_HUM: Final = (0.01,) * 3 + (0.0004,) * 3
"""Standard deviations of the noise, N and N m, that is added to each reading, as sensor noise varies within a tick."""
_SHARED: Final = "  # emulated devices share this computer with the loop; leave this out for real ones"


class EmulatedCell:
    """Simulated work cell with emulated devices. Used as a context manager, it serves the devices.

    A Zebra Zero starts in its home pose, any other arm in the ready pose. Drives start in their power-up state; a
    Universal Robots controller is on and in remote control mode.

    Args:
        config: The simulated cell; trial 0 of its seed determines the hole and the sensor errors.
        counts_file: File that keeps the arm's counters between runs, as named in the rig file.
    """

    def __init__(
        self, config: RunConfig, ready: ReadyPose, emulation: EmulationConfig, counts_file: str = "",
        events: Sequence[str] = (), hidden: HiddenValues | None = None,
    ) -> None:  # fmt: skip
        arm = arm_named(config.arm)
        emulation, kinematics = emulation.wired(arm), Kinematics(arm, config.tool.geometry)
        self.config, self.emulation = config, emulation
        self.hidden = hidden or (HiddenValues.drawn(config.seed) if emulation.hide else HiddenValues())
        self.cell = WorkCell(
            kinematics,
            self.hidden.cell(config.cell),
            goal_in_base=goal_in_base(config.task.goal),
            ready_rad=ready.q_rad,
            rate_Hz=CONTROL_RATE_HZ,
            wander_m=wander_m(config.task),
            hidden=self.hidden,
        )
        self.cell.reset(config.seed, 0)
        start = HOME_RAD if emulation.wires == ZEBRA else tuple(ready.q_rad.tolist())
        self.cell.place(start)
        # Time, wrench and change of the wrench; always replaced as a whole, because servers read it in other threads.
        self._hum = np.random.default_rng(6)
        self._measured: tuple[int, list[float], list[float]] = 0, self.cell.measure_wrench(), [0.0] * 6
        self._servers, self._start_rad = ExitStack(), start
        # Devices and cell share one clock.
        self._clock = clock = MonotonicClock(0, emulation.real_time_factor)
        self.arm = emulated_arm(config, emulation, start, self._wrench_source, clock.now_ns, counts_file)
        self.sensor = emulated_sensor(config, emulation, self.arm, self._wrench_source, clock.now_ns)
        self._faults = self.arm.faults | self.sensor.faults
        self._events = [PlannedEvent.of(event, self._faults) for event in events]
        self.insertions = 0
        self._was_inside = False

    def __enter__(self) -> Self:
        with self._servers as opened:
            for device in (self.arm, self.sensor):
                opened.enter_context(device.server)
            self._servers = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._servers.close()

    def job_toml(self) -> str:
        """Return the job file for the cell, without values that only the simulator has."""
        stated, arm = self.config, self.config.arm
        named = f'name = "{arm}"\n' if isinstance(arm, str) else to_toml(arm)
        job = to_toml(Job(stated.part, stated.tool, stated.place, stated.limits))
        return f"{job.lstrip()}\n[arm]\n{named}"

    def rig_toml(self, job: str = "") -> str:
        """Return a rig file for these devices, which refers to the job file next to it. The devices must be served."""
        name = f"emulated {self.config.arm} by {self.emulation.wires} and {self.emulation.force}"
        lines = [f'format = {RIG_FORMAT}\n\n[rig]\nname = "{name}"\nemulated = true\n']
        if (factor := self.emulation.real_time_factor) != 1.0:
            lines.append(f"real_time_factor = {factor}\n")
        lines += [f"arm_lag_ms = {self.arm.lag_ms}\n"]
        lines += [f"job = {literal(job)}\n"] if job else []
        sensor = {**self.sensor.entries(), "facts": self.sensor.facts}
        # An arm by its URDF is in the job file.
        named = {"name": self.config.arm} if isinstance(self.config.arm, str) else {}
        for table, entries in (("arm", named | self.arm.entries()), ("force_sensor", sensor)):
            lines.append(f"\n[{table}]\n")
            lines += (
                f"{key} = {literal(value)}{_SHARED if key == 'timeout_scale' else ''}\n"
                for key, value in entries.items()
            )
        lines.append(f"\n[watchdog]\nsetpoint_timeout_ms = 500.0{_SHARED}\n")
        return "".join(lines)

    def targets_rad(self) -> JointVector:
        """Return the set-points held by all joint motors at a single instant."""
        with self.arm.hold():
            return self.arm.motors.targets_rad()

    def tick(self, now_ns: int) -> tuple[JointVector, JointVector]:
        """Simulate one control tick; return the joints' set-points and angles, (n,) rad each."""
        targets = self.targets_rad()
        self.cell.command(targets)
        self.cell.advance()
        before = self.cell.before_errors
        wrench = self.cell.measure_wrench()
        self._measured = now_ns, wrench, list(map(sub, before, self.cell.before_errors))
        joints = self.cell.joint_angles()
        with self.arm.hold():
            self.arm.motors.measured_rad(joints)
        return targets, joints

    def run(
        self,
        ended: Callable[[], bool],
        notify: Callable[[GroundTruth], None],
        happened: Callable[[PlannedEvent], object] = str,
    ) -> None:
        """Run the cell in real time until ``ended()`` is true; report each event and each insertion's ground truth."""
        clock = self._clock
        begun_ns = deadline_ns = start_ns = clock.now_ns()
        moved_ns = tick = 0
        while not ended():
            time_ns = clock.now_ns()
            targets, _ = self.tick(time_ns)
            if not moved_ns and targets != self._start_rad:
                moved_ns = time_ns
            for event in [each for each in self._events if each.due(time_ns, begun_ns, moved_ns)]:
                self._events.remove(event)
                self._faults[event.name]()
                happened(event)
            self._watch(notify)
            tick += 1
            deadline_ns = start_ns + tick * _NS // CONTROL_RATE_HZ
            if clock.now_ns() - deadline_ns > _NS // 10:
                # Far behind, for example after the computer was suspended: skip the missed ticks.
                deadline_ns = start_ns = clock.now_ns()
                tick = 0
            else:
                clock.sleep_until(deadline_ns)

    def _watch(self, notify: Callable[[GroundTruth], None]) -> None:
        if self.cell.ticks % 14:
            return
        truth = self.cell.truth()
        inside = truth.depth_m >= self.config.task.insertion_depth_mm * 1e-3 - _INSERTED_M
        if inside and not self._was_inside:
            self.insertions += 1
            notify(truth)
        self._was_inside = inside

    def _wrench_source(self, now_ns: int) -> tuple[float, ...]:
        """Return the wrench at a given time; a held value's age would depend on when it is read."""
        ticked_ns, wrench, steps = self._measured
        ahead = min(max((now_ns - ticked_ns) * CONTROL_RATE_HZ / _NS, 0.0), 1.0) - 0.5
        parts = zip(wrench, steps, _HUM, self._hum.standard_normal(6).tolist(), strict=True)
        return tuple(measured + ahead * step + sd * draw for measured, step, sd, draw in parts)
