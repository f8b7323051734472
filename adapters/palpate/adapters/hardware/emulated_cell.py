"""The work cell behind wires: MuJoCo moves the arm, and whoever wants to talk to it opens a serial port."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from functools import partial
from math import radians
from operator import sub
from typing import Any, Final, Protocol, Self

import numpy as np
import pinocchio as pin

from palpate.adapters.config import RIG_FORMAT, ROS2, UR, ZEBRA, EmulationConfig, RunConfig, literal, to_toml
from palpate.adapters.hardware.clock import MonotonicClock
from palpate.adapters.hardware.emulated_events import PlannedEvent
from palpate.core.job import Job
from palpate.core.motion import Kinematics, arm_named, controller_frames
from palpate.core.ports import CONTROL_RATE_HZ, JointVector, Truth
from palpate.core.trial import ReadyPose, goal_in_base, wander_m
from palpate.simulation.emulators.ati import EmulatedBox, NetFtServer
from palpate.simulation.emulators.cia402 import CanopenDrive
from palpate.simulation.emulators.jr3 import Jr3CanNode, Jr3Config
from palpate.simulation.emulators.lines import EmulatedCanBus, LineSpeed, PtyServer, SlcanServer
from palpate.simulation.emulators.motors import HOME_RAD, DirectMotors, JointPlant
from palpate.simulation.emulators.nmc import NmcChain
from palpate.simulation.emulators.ros2 import WRENCH, Ros2Robot, Ros2Server
from palpate.simulation.emulators.ur import PRECISION, ControllerConfig, ToolForce, UrController, UrServer
from palpate.simulation.work_cell import HiddenValues, WorkCell

_NS: Final = 1_000_000_000
_JR3_NODE: Final = 9
_COUNTS_PER_RAD: Final = 192_000 / 6.283185307179586
_INSERTED_M: Final = 5e-5
_BEHIND_FILTER: Final = 0.77
"""Share of the cell's noise, new each control tick, that the board's filter of 50 Hz lets through; measured."""
_HUM: Final = (0.01,) * 3 + (0.0004,) * 3
"""Standard deviations of what is new at each look, N and N m: a sensor's noise does not stand still with the cell."""
_SHARED: Final = "  # emulated devices share this computer with the loop; leave this out for real ones"
_NO_VOLTAGE: Final = 0x3220
"""EMCY code of CiA 402 for a DC link without voltage: what an emergency stop leaves of it."""
_NO_TRANSDUCER: Final = 1 << 31 | 1 << 4
"""Status word of a Net F/T box whose transducer is unplugged."""


class Motors(Protocol):
    """Motors in front of the simulated arm."""

    def targets_rad(self) -> JointVector:
        """Joint set-points that they hold now."""

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Where the joints are."""


class EmulatedCell:
    """The work cell with its devices on pseudo-terminals. A context manager: inside, the devices are served.

    The Zebra starts in its home pose, any other arm in the ready pose; drives are as after power-up, a controller of
    Universal Robots is switched on and in remote control.

    Args:
        config: The simulated cell; trial 0 of its seed gives hole and sensor errors.
        counts_file: Where the rig file lets the arm's counters be kept from run to run.
        events: What happens to the devices, as the option ``--event`` has it.
        hidden: What else the rig keeps to itself.
    """

    def __init__(
        self, config: RunConfig, ready: ReadyPose, emulation: EmulationConfig, counts_file: str = "",
        events: Sequence[str] = (), hidden: HiddenValues | None = None,
    ) -> None:  # fmt: skip
        arm = arm_named(config.arm)
        emulation, kinematics = emulation.wired(arm), Kinematics(arm, config.tool.geometry)
        self.config, self.emulation, self._counts_file = config, emulation, counts_file
        # One by its URDF is in the job file.
        self._arm_name: Any = config.arm if isinstance(config.arm, str) else {}
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
        # Replaced whole, for servers have threads of their own: when, what was felt, and by how much more than before.
        self._hum = np.random.default_rng(6)
        self._felt: tuple[int, list[float], list[float]] = 0, self.cell.measure_wrench(), [0.0] * 6
        self._motors: Motors
        self._hold: Callable[[], AbstractContextManager[Any]] = nullcontext
        self._servers = ExitStack()
        self._entries: dict[str, dict[str, Any]] = {}
        self._served: list[tuple[AbstractContextManager[Any], str, Callable[[], dict[str, Any]]]] = []
        self._start_rad, self._faults = start, dict[str, Callable[[], object]]()
        self._prepare_arm(start)
        self._prepare_sensor()
        self._events = [PlannedEvent.of(event, self._faults) for event in events]
        self.insertions = 0
        self._was_inside = False

    def __enter__(self) -> Self:
        with self._servers as opened:
            for server, table, entries in self._served:
                opened.enter_context(server)
                self._entries[table] = entries()
            self._servers = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._servers.close()

    def job_toml(self) -> str:
        """The job of the cell, as far as a person would state it: nothing that only the simulator knows."""
        stated, arm = self.config, self.config.arm
        named = f'name = "{arm}"\n' if isinstance(arm, str) else to_toml(arm)
        job = to_toml(Job(stated.part, stated.tool, stated.place, stated.limits))
        return f"{job.lstrip()}\n[arm]\n{named}"

    def rig_toml(self, job: str = "") -> str:
        """The rig file for these devices; known once they are served.

        Args:
            job: Name of the job file, next to it.
        """
        name = f"emulated {self.config.arm} by {self.emulation.wires} and {self.emulation.force}"
        lines = [f'format = {RIG_FORMAT}\n\n[rig]\nname = "{name}"\nemulated = true\n']
        lines += [f"job = {literal(job)}\n"] if job else []
        for table, entries in self._entries.items():
            lines.append(f"\n[{table}]\n")
            for name, value in entries.items():
                note = _SHARED if name == "patience" else ""
                lines += [f"{name} = {literal(value)}{note}\n"] if value != {} else []
        lines.append(f"\n[watchdog]\nsetpoint_timeout_ms = 500.0{_SHARED}\n")
        return "".join(lines)

    def targets_rad(self) -> JointVector:
        """Joint set-points that the motors hold now, whatever the bus has told them: where they stand still, all do."""
        with self._hold():
            return self._motors.targets_rad()

    def tick(self, now_ns: int) -> tuple[JointVector, JointVector]:
        """Let the cell live for a control tick; returns set-points and places of the joints, (n,) rad each."""
        targets = self.targets_rad()
        self.cell.command(targets)
        self.cell.advance()
        before = self.cell.before_errors
        wrench = self.cell.measure_wrench()
        self._felt = now_ns, wrench, list(map(sub, before, self.cell.before_errors))
        joints = self.cell.joint_angles()
        with self._hold():
            self._motors.measured_rad(joints)
        return targets, joints

    def run(
        self,
        ended: Callable[[], bool],
        told: Callable[[Truth], None],
        happened: Callable[[PlannedEvent], object] = str,
    ) -> None:
        """Let the cell live in real time.

        Args:
            told: Called with the truth when the peg has newly reached full depth.
        """
        clock = MonotonicClock()
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
            self._watch(told)
            tick += 1
            deadline_ns = start_ns + tick * _NS // CONTROL_RATE_HZ
            if clock.now_ns() - deadline_ns > _NS // 10:
                # Far behind, as after a suspended machine: time goes on from here, nothing is made up for.
                deadline_ns = start_ns = clock.now_ns()
                tick = 0
            else:
                clock.sleep_until(deadline_ns)

    def _watch(self, told: Callable[[Truth], None]) -> None:
        if self.cell.ticks % 14:
            return
        truth = self.cell.truth()
        inside = truth.depth_m >= self.config.task.insertion_depth_mm * 1e-3 - _INSERTED_M
        if inside and not self._was_inside:
            self.insertions += 1
            told(truth)
        self._was_inside = inside

    def _wrench_source(self, now_ns: int) -> tuple[float, ...]:
        """What is felt: it goes on as it went in the last tick, half of one back at first, half of one ahead at last.

        Held from tick to tick it is as old on average, but up to a tick older, by when a trial happens to begin.
        """
        ticked_ns, wrench, steps = self._felt
        ahead = min(max((now_ns - ticked_ns) * CONTROL_RATE_HZ / _NS, 0.0), 1.0) - 0.5
        parts = zip(wrench, steps, _HUM, self._hum.standard_normal(6).tolist(), strict=True)
        return tuple(felt + ahead * step + sd * draw for felt, step, sd, draw in parts)

    def _held(self, action: Callable[[], object]) -> Callable[[], None]:
        """The action, while the server's thread does nothing."""

        def act() -> None:
            with self._hold():
                action()

        return act

    def _serve(self, server: AbstractContextManager[Any], table: str, entries: Callable[[], dict[str, Any]]) -> None:
        """Have a server started on entry; only then is known what the rig file has to say of it."""
        self._served.append((server, table, entries))

    def _prepare_arm(self, start: JointVector) -> None:
        emulation = self.emulation
        if emulation.wires == ZEBRA:
            plant = JointPlant(start, radians(emulation.wrist_backlash_deg))
            timing = LineSpeed(usb_latency_s=emulation.usb_latency_ms * 1e-3)
            chain = NmcChain(plant)
            server = PtyServer(chain, timing)
            self._motors, self._hold = plant, server.exclusive
            self._faults["cable-pulled"] = server.unplug
            self._faults["emergency-stop"] = self._held(lambda: chain.set_power(powered=False))
            # Emulated modules wake at once: the wait is for the reset to get through line and adapter.
            self._serve(server, "arm", lambda: {
                "adapter": "zebra-nmc", "name": self._arm_name, "port": server.path, "baud": emulation.baud,
                "adapter_latency_ms": emulation.usb_latency_ms, "divider": emulation.divider, "at_home": True,
                "counts_file": self._counts_file, "reset_wait_ms": 20.0 + 2.0 * emulation.usb_latency_ms,
            })  # fmt: skip
            return
        if emulation.wires == UR:
            self._prepare_ur(start)
            return
        if emulation.wires == ROS2:
            self._prepare_ros2(start)
            return
        scale = (_COUNTS_PER_RAD,) * len(start)
        motors = DirectMotors(scale, start)
        self._motors = motors
        drives = [CanopenDrive(axis + 1, motors, axis) for axis in range(len(start))]
        bus = SlcanServer(EmulatedCanBus(drives))
        self._faults["cable-pulled"] = bus.unplug
        self._faults["emergency-stop"] = lambda: bus.do(partial(_lose_voltage, drives))
        self._serve(bus, "arm", lambda: {
            "adapter": "cia402", "name": self._arm_name, "interface": "slcan", "channel": bus.channel,
            "divider": emulation.divider,
            "nodes": [drive + 1 for drive in range(len(start))], "counts_per_rad": list(scale), "patience": 10.0,
        })  # fmt: skip

    def _prepare_ur(self, start: JointVector) -> None:
        pendant = ControllerConfig(arm=str(self.config.arm), **self._entered())
        controller = UrController(start, ToolForce(self._wrench_source), pendant)
        server = self.ur = UrServer(controller)
        self._motors, self._hold = controller, server.exclusive
        self._faults |= {
            "protective-stop": self._held(controller.protective_stop),
            "emergency-stop": self._held(controller.emergency_stop),
            "program-end": self._held(controller.end_program),
            "cable-pulled": lambda: setattr(server, "is_unplugged", True),
        }
        self._serve(server, "arm", lambda: {
            "adapter": "ur-rtde", "name": self._arm_name, "host": server.host, "guard_N": 45.0, "patience": 5.0,
        })  # fmt: skip
        if self.emulation.force == UR:
            noise_N, noise_Nm = (precision / 2.0 for precision in PRECISION)
            facts = {"noise_N": noise_N, "noise_Nm": noise_Nm}
            self._serve(
                nullcontext(), "force_sensor", lambda: {"adapter": "ur-rtde", "host": server.host, "facts": facts}
            )

    def _prepare_ros2(self, start: JointVector) -> None:
        names = Kinematics(arm_named(self.config.arm), self.config.tool.geometry).model.names
        robot = Ros2Robot(tuple(names)[1 : len(start) + 1], start)
        server = self.ros2 = Ros2Server(robot, self._wrench_source)
        self._motors, self._hold = robot, server.exclusive
        self._faults["cable-pulled"] = lambda: setattr(server, "is_unplugged", True)

        def network() -> dict[str, Any]:
            return {"adapter": "ros2", "domain": server.domain, "address": server.address, "peers": [server.address]}

        self._serve(server, "arm", lambda: {
            **network(), "name": self._arm_name, "commands": f"/{server.commands}", "patience": 5.0,
        })  # fmt: skip
        if self.emulation.force == ROS2:
            # The robot states no range: that of a common sensor.
            facts: dict[str, Any] = {**self._facts(1.0), "range_N": [300.0] * 3, "range_Nm": [20.0] * 3}
            self._serve(nullcontext(), "force_sensor", lambda: {
                **network(), "topic": f"/{WRENCH}", "rate_Hz": server.rate_Hz, "facts": facts,
            })  # fmt: skip

    def _entered(self) -> dict[str, Any]:
        """What is entered at the emulated pendant: the tool of the job, in the axes of the flange."""
        tool, frames = self.config.tool, Kinematics(arm_named(self.config.arm), self.config.tool.geometry)
        start = tuple(self.cell.joint_angles())
        frames.update(start)
        flange = controller_frames(frames.arm, start)[1]
        tip, sensor = flange.actInv(frames.tip_in_base), flange.actInv(frames.sensor_in_base)
        centre_m = sensor.act(np.array(tool.centre_of_mass_mm) * 1e-3)
        places = (*tip.translation.tolist(), *pin.log3(tip.rotation).tolist())
        rounded = [tuple(round(value, 6) + 0.0 for value in values) for values in (centre_m.tolist(), places)]
        return {"payload_kg": tool.mass_kg, "payload_cog_m": rounded[0], "tcp_offset": rounded[1]}

    def _prepare_sensor(self) -> None:
        if self.emulation.force in (UR, ROS2):
            return
        if self.emulation.force == "ati-netft":
            device = EmulatedBox(self._wrench_source)
            self._faults["sensor-silent"] = lambda: setattr(device, "network", lambda datagrams: [])
            self._faults["sensor-cable"] = lambda: setattr(device, "status", _NO_TRANSDUCER)
            box = NetFtServer(device)
            # Its records are not filtered: the cell's noise is theirs.
            self._serve(box, "force_sensor", lambda: {
                "adapter": "ati-netft", "host": box.host, "port": box.port, "http_port": box.http_port,
                "facts": self._facts(1.0),
            })  # fmt: skip
            return
        # The board was switched on long before anyone connects.
        node = Jr3CanNode(_JR3_NODE, self._wrench_source, Jr3Config(boot_ns=0))
        self._faults["sensor-silent"] = lambda: setattr(node.firmware, "silent", True)
        self._faults["sensor-cable"] = lambda: setattr(node.firmware, "connected", False)
        bus = SlcanServer(EmulatedCanBus([node]))
        self._serve(bus, "force_sensor", lambda: {
            "adapter": "jr3-can", "interface": "slcan", "channel": bus.channel, "node": _JR3_NODE,
            "facts": self._facts(),
        })  # fmt: skip

    def _facts(self, share: float = _BEHIND_FILTER) -> dict[str, float]:
        """What the emulated sensor does not report: the noise that the simulated cell gives it, behind its filter."""
        noise = self.config.cell.sensor
        return {
            "noise_N": round(share * noise.force_noise_N, 6),
            "noise_Nm": round(share * noise.torque_noise_Nm, 6),
        }


def _lose_voltage(drives: Sequence[CanopenDrive], _now_ns: int) -> None:
    for drive in drives:
        drive.fail(_NO_VOLTAGE)
