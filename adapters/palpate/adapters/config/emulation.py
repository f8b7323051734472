"""What is emulated behind wires, and how badly."""

from dataclasses import dataclass
from typing import Annotated, Final

from typing_extensions import override

from palpate.core.errors import ConfigurationError
from palpate.core.ports import OneOf, Range, Settings

UR_ARMS: Final = ("ur5-rtde", "ur3e-rtde", "ur5e-rtde", "ur10e-rtde", "ur16e-rtde", "ur20-rtde")
EMULATED_ARMS: Final = ("zebra-nmc", "cia402", *UR_ARMS)


@dataclass(frozen=True)
class EmulationConfig(Settings):
    """Which devices an emulated rig has, and what a rig file does not say of them."""

    arm: Annotated[str, OneOf(*EMULATED_ARMS)] = "zebra-nmc"
    """Arm: zebra-nmc (the Zebra Zero's own serial bus), cia402 (a refit with CAN drives) or ur5-rtde, ur10e-rtde and
    others (behind a controller of Universal Robots, at the first free address from 127.0.0.1 on)."""
    force: Annotated[str, OneOf("jr3-can", "ati-netft", "ur-rtde")] = "jr3-can"
    """Force sensor: jr3-can, ati-netft, or ur-rtde, the one in the flange of an arm of Universal Robots."""
    baud: int = 230_400
    """Line rate of the arm's serial bus."""
    divider: Annotated[int, Range(1, 14)] = 2
    """Control ticks per bus cycle: 2 is 70 Hz."""
    wrist_backlash_deg: Annotated[float, Range(0.0, 5.0)] = 0.0
    """Full gap of the wrist's gears."""
    usb_latency_ms: Annotated[float, Range(0.0, 100.0)] = 0.0
    """Latency timer of an emulated USB adapter on the arm's serial line; 16 is usual, 1 a good setting."""
    hide: bool = False
    """Let the tool's weight, the sensor's mounting, the plate's height, the hole's place and the gripper's stiffness be
    other than the rig file has them, drawn from the seed: palpate calibrate has to find them."""
    friction: Annotated[float, Range(0.0, 2.0)] = 0.0
    """Friction between peg and plate; 0: as configured. This and the next two are for system identification to find."""
    stiffness_share: Annotated[float, Range(0.05, 20.0)] = 1.0
    """Stiffness of the gripper's springs, as a share of the configured one."""
    latency_ms: Annotated[float, Range(0.0, 200.0)] = 0.0
    """By how much wrenches come late."""

    @override
    def check(self) -> None:
        if self.wrist_backlash_deg and self.arm != "zebra-nmc":
            raise ConfigurationError("wrist_backlash_deg", self.wrist_backlash_deg, "0, except for zebra-nmc")
        if self.force == "ur-rtde" and self.arm not in UR_ARMS:
            accepted = "ur-rtde only with --arm ur5e-rtde or another of its maker: the sensor is in its flange"
            raise ConfigurationError("force", self.force, accepted)
