"""Settings for emulated devices."""

from dataclasses import dataclass, replace
from typing import Annotated, Final, Self

from palpate.adapters.config.described import RARE
from palpate.core.errors import ConfigurationError
from palpate.core.motion import ArmDescription
from palpate.core.ports import OneOf, Range, Settings

ZEBRA: Final = "zebra-nmc"
CIA402: Final = "cia402"
UR: Final = "ur-rtde"
ROS2: Final = "ros2"
JR3, ATI = "jr3-can", "ati-netft"
_OF_UR: Final = ("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "ur16e", "ur20")


@dataclass(frozen=True)
class EmulationConfig(Settings):
    """Devices in an emulated rig, with settings that a rig file does not contain."""

    wires: Annotated[str, OneOf("", ZEBRA, CIA402, UR, ROS2)] = ""
    """Arm interface: zebra-nmc (the Zebra Zero's serial bus), cia402 (CAN drives), ur-rtde (a Universal
    Robots controller, at the first free address from 127.0.0.1 on) or ros2 (a free domain on loopback). Default: the
    arm's own interface, else cia402."""
    force: Annotated[str, OneOf("", JR3, ATI, UR, ROS2)] = ""
    """Force sensor: jr3-can, ati-netft, ur-rtde (in the flange; needs wires ur-rtde) or ros2 (needs wires ros2).
    Default: ati-netft with wires ur-rtde, ros2 with wires ros2, else jr3-can."""
    baud: Annotated[int, RARE] = 230_400
    """Line rate of the arm's serial bus."""
    velocity_stop_ms: Annotated[Annotated[float, Range(0.0, 10_000.0)] | None, RARE] = None
    """With wires ros2: accept velocities; stop the arm N ms after the last one, or never with 0. Default: positions."""
    divider: Annotated[int, Range(1, 14), RARE] = 2
    """Control ticks per bus cycle: 2 gives 70 Hz."""
    real_time_factor: Annotated[float, Range(0.01, 1.0)] = 1.0
    """Simulated seconds per real second for devices, loop and physics; use less than 1 on a slow computer."""
    hide: bool = False
    """Draw the tool's weight, the sensor's mounting, the plate's height, the hole's position and the gripper's
    stiffness from the seed, so that they differ from the rig file. Use it to practise palpate rig calibrate."""

    def wired(self, arm: ArmDescription) -> Self:
        """Return a copy of these settings with the arm's interface and force sensor filled in.

        Raises:
            ConfigurationError: The arm does not support the interface, or the interface does not support the sensor.
        """
        usual = ZEBRA if arm.name == "zebra-zero" else UR if arm.name in _OF_UR else CIA402
        wires = self.wires or usual
        if wires == ZEBRA and usual != ZEBRA:
            raise ConfigurationError("wires", wires, f"cia402 for {arm.name}; the bus is a Zebra Zero's")
        if wires == UR and usual != UR:
            raise ConfigurationError("wires", wires, f"cia402 for {arm.name}; the controller has {', '.join(_OF_UR)}")
        in_flange = "jr3-can or ati-netft: the sensor is in the flange of a UR"
        self.require("force", self.force != UR or wires == UR, in_flange)
        self.require("force", self.force != ROS2 or wires == ROS2, "another sensor, or wires ros2 too")
        return replace(self, wires=wires, force=self.force or {UR: ATI, ROS2: ROS2}.get(wires, JR3))
