"""Emulated devices for the simulated cell, with their servers, rig file entries and faults."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Any, Final, Protocol, TypeAlias

import numpy as np
import pinocchio as pin

from palpate.adapters.config import ROS2, UR, ZEBRA, EmulationConfig, RunConfig
from palpate.core.motion import Kinematics, arm_named, controller_frames
from palpate.core.ports import JointVector
from palpate.simulation.emulators.ati import EmulatedBox, NetFtServer
from palpate.simulation.emulators.cia402 import CanopenDrive
from palpate.simulation.emulators.jr3 import Jr3CanNode
from palpate.simulation.emulators.lines import EmulatedCanBus, PtyServer, SlcanAdapter
from palpate.simulation.emulators.motors import DirectGears, JointPlant
from palpate.simulation.emulators.nmc import NmcChain
from palpate.simulation.emulators.ros2 import WRENCH, Ros2Robot, Ros2Server
from palpate.simulation.emulators.ur import PRECISION, ControllerConfig, ToolForce, UrController, UrServer

WrenchSource: TypeAlias = Callable[[int], tuple[float, ...]]
"""Function that returns the wrench on the sensor, (6,) in N and N m, at a given time in ns."""
ClockNs: TypeAlias = Callable[[], int]
"""The devices' clock, in ns."""
_JR3_NODE: Final = 9
_COUNTS_PER_RAD: Final = 192_000 / 6.283185307179586
_BEHIND_FILTER: Final = 0.77
"""Measured fraction of the cell's noise that passes the board's 50 Hz filter. The noise changes every control tick."""
_NO_VOLTAGE: Final = 0x3220
"""CiA 402 EMCY code for a DC link without voltage, as after an emergency stop."""
_NO_TRANSDUCER: Final = 1 << 31 | 1 << 4
"""Status word of a Net F/T box whose transducer is unplugged."""


class Motors(Protocol):
    """Motors of the simulated arm."""

    def targets_rad(self) -> JointVector:
        """Return the joint set-points that the motors hold."""

    def measured_rad(self, joints_rad: JointVector) -> None:
        """Set the joint angles."""


@dataclass
class EmulatedDevice:
    """An emulated device with its server.

    Attributes:
        entries: Function that returns the device's entries in the rig file. Call it only while the device is served,
            because the address is not known before then.
        faults: Functions that trigger faults, by event name.
    """

    server: AbstractContextManager[Any]
    entries: Callable[[], dict[str, Any]]
    faults: dict[str, Callable[[], object]] = field(default_factory=dict)
    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(kw_only=True)
class EmulatedArm(EmulatedDevice):
    """An emulated arm with its server.

    Attributes:
        hold: Context in which the server's thread does not access the motors.
        lag_ms: Measured delay between a command and the joint motion, including communication.
        in_flange: Force sensor in the arm's flange.
    """

    motors: Motors
    lag_ms: float
    hold: Callable[[], AbstractContextManager[Any]] = nullcontext
    in_flange: EmulatedDevice | None = None

    def held(self, action: Callable[[], object]) -> Callable[[], None]:
        """Return a function that performs the action while the server's thread is paused."""

        def act() -> None:
            with self.hold():
                action()

        return act


def emulated_arm(
    config: RunConfig,
    emulation: EmulationConfig,
    start: JointVector,
    feel: WrenchSource,
    clock_ns: ClockNs,
    counts_file: str,
) -> EmulatedArm:
    """Return an emulated arm with the chosen interface, at these joint angles."""
    if emulation.wires == ZEBRA:
        return _zebra(emulation, start, clock_ns, counts_file)
    if emulation.wires == UR:
        return _ur(config, start, feel, clock_ns)
    if emulation.wires == ROS2:
        return _ros2(config, emulation.velocity_stop_ms, start, feel, clock_ns)
    return _cia402(emulation, start, clock_ns)


def _zebra(emulation: EmulationConfig, start: JointVector, clock_ns: ClockNs, counts_file: str) -> EmulatedArm:
    plant = JointPlant(start)
    chain = NmcChain(plant)
    server = PtyServer(chain, clock_ns)
    # Emulated modules restart at once; the wait covers only the transmission of the reset.
    arm = EmulatedArm(server, lambda: {
        "adapter": "zebra-nmc", "port": server.path, "baud": emulation.baud,
        "adapter_latency_ms": 0.0, "divider": emulation.divider, "at_home": True,
        "counts_file": counts_file, "reset_wait_ms": 20.0,
        "timeout_scale": 1.0 / emulation.real_time_factor,
    }, motors=plant, lag_ms=40.0, hold=server.exclusive)  # fmt: skip
    arm.faults["cable-pulled"] = server.unplug
    arm.faults["emergency-stop"] = arm.held(lambda: chain.set_power(powered=False))
    return arm


def _cia402(emulation: EmulationConfig, start: JointVector, clock_ns: ClockNs) -> EmulatedArm:
    scale = (_COUNTS_PER_RAD,) * len(start)
    motors = JointPlant(start, DirectGears(scale))
    drives = [CanopenDrive(axis + 1, motors, axis) for axis in range(len(start))]
    server = PtyServer(SlcanAdapter(EmulatedCanBus(drives)), clock_ns, paced=False)
    arm = EmulatedArm(server, lambda: {
        "adapter": "cia402", "interface": "slcan", "channel": server.path, "divider": emulation.divider,
        "nodes": [drive + 1 for drive in range(len(start))], "counts_per_rad": list(scale), "timeout_scale": 10.0,
    }, motors=motors, lag_ms=40.0, hold=server.exclusive)  # fmt: skip
    arm.faults["cable-pulled"] = server.unplug
    arm.faults["emergency-stop"] = arm.held(lambda: _lose_voltage(drives))
    return arm


def _ur(config: RunConfig, start: JointVector, feel: WrenchSource, clock_ns: ClockNs) -> EmulatedArm:
    controller = UrController(start, ToolForce(feel), ControllerConfig(arm=str(config.arm), **_entered(config, start)))
    server = UrServer(controller, clock_ns)
    noise_N, noise_Nm = (precision / 2.0 for precision in PRECISION)
    facts = {"noise_N": noise_N, "noise_Nm": noise_Nm}
    arm = EmulatedArm(
        server, lambda: {"adapter": "ur-rtde", "host": server.host, "force_stop_N": 45.0, "timeout_scale": 5.0},
        motors=controller, lag_ms=45.0, hold=server.exclusive,
        in_flange=EmulatedDevice(nullcontext(), lambda: {"adapter": "ur-rtde", "host": server.host}, facts=facts),
    )  # fmt: skip
    arm.faults |= {
        "protective-stop": arm.held(controller.protective_stop),
        "emergency-stop": arm.held(controller.emergency_stop),
        "program-end": arm.held(controller.end_program),
        "cable-pulled": lambda: setattr(server, "is_unplugged", True),
    }
    return arm


def _ros2(
    config: RunConfig, stop_ms: float | None, start: JointVector, feel: WrenchSource, clock_ns: ClockNs
) -> EmulatedArm:
    names = Kinematics(arm_named(config.arm), config.tool.geometry).model.names
    velocities = stop_ms is not None
    robot = Ros2Robot(tuple(names)[1 : len(start) + 1], start, velocities=velocities, stop_ms=stop_ms or 0.0)
    server = Ros2Server(robot, feel, clock_ns=clock_ns)
    # The robot does not report a range; this is the range of a common sensor.
    facts: dict[str, Any] = {**_noise(config), "range_N": [300.0] * 3, "range_Nm": [20.0] * 3}

    def network() -> dict[str, Any]:
        return {"adapter": "ros2", "domain": server.domain, "address": server.address, "peers": [server.address]}

    wrench = EmulatedDevice(
        nullcontext(), lambda: {**network(), "topic": f"/{WRENCH}", "rate_Hz": server.rate_Hz}, facts=facts
    )
    return EmulatedArm(
        server, lambda: {
            **network(), "commands": f"/{server.commands}", "timeout_scale": 5.0,
            **({"mode": "velocities", "stops_without_commands": True} if velocities else {}),
        },
        {"cable-pulled": lambda: setattr(server, "is_unplugged", True)},
        motors=robot, lag_ms=25.0, hold=server.exclusive, in_flange=wrench,
    )  # fmt: skip


def emulated_sensor(
    config: RunConfig, emulation: EmulationConfig, arm: EmulatedArm, feel: WrenchSource, clock_ns: ClockNs
) -> EmulatedDevice:
    """Return the chosen force sensor."""
    if emulation.force in (UR, ROS2) and arm.in_flange is not None:
        return arm.in_flange
    if emulation.force == "ati-netft":
        device = EmulatedBox(feel)
        box = NetFtServer(device, clock_ns)
        faults: dict[str, Callable[[], object]] = {
            "sensor-silent": lambda: setattr(device, "network", lambda datagrams: []),
            "sensor-cable": lambda: setattr(device, "status", _NO_TRANSDUCER),
        }
        # The box does not filter its records, so they have the full noise of the cell.
        return EmulatedDevice(box, lambda: {
            "adapter": "ati-netft", "host": box.host, "port": box.port, "http_port": box.http_port,
        }, faults, _noise(config))  # fmt: skip
    # The board has finished booting before a client connects.
    node = Jr3CanNode(_JR3_NODE, feel, boot_ns=0)
    server = PtyServer(SlcanAdapter(EmulatedCanBus([node])), clock_ns, paced=False)
    faults = {
        "sensor-silent": lambda: setattr(node.firmware, "silent", True),
        "sensor-cable": lambda: setattr(node.firmware, "connected", False),
    }
    return EmulatedDevice(server, lambda: {
        "adapter": "jr3-can", "interface": "slcan", "channel": server.path, "node": _JR3_NODE,
    }, faults, _noise(config, _BEHIND_FILTER))  # fmt: skip


def _noise(config: RunConfig, share: float = 1.0) -> dict[str, Any]:
    """Return the simulated cell's noise after the sensor's filter; the sensor does not report its noise."""
    noise = config.cell.sensor
    return {"noise_N": round(share * noise.force_noise_N, 6), "noise_Nm": round(share * noise.torque_noise_Nm, 6)}


def _entered(config: RunConfig, start: JointVector) -> dict[str, Any]:
    """Return the pendant settings for the job's tool, in flange axes."""
    tool, frames = config.tool, Kinematics(arm_named(config.arm), config.tool.geometry)
    frames.update(start)
    flange = controller_frames(frames.arm, start)[1]
    tip, sensor = flange.actInv(frames.tip_in_base), flange.actInv(frames.sensor_in_base)
    centre_m = sensor.act(np.array(tool.centre_of_mass_mm) * 1e-3)
    places = (*tip.translation.tolist(), *pin.log3(tip.rotation).tolist())
    rounded = [tuple(round(value, 6) + 0.0 for value in values) for values in (centre_m.tolist(), places)]
    return {"payload_kg": tool.mass_kg, "payload_cog_m": rounded[0], "tcp_offset": rounded[1]}


def _lose_voltage(drives: Sequence[CanopenDrive]) -> None:
    for drive in drives:
        drive.fail(_NO_VOLTAGE)
