"""What ``lerobot-record --robot.type=palpate`` takes."""

from dataclasses import dataclass

from lerobot.robots import RobotConfig


@RobotConfig.register_subclass("palpate")
@dataclass(kw_only=True)
class PalpateConfig(RobotConfig):
    """A work cell in MuJoCo, or a rig.

    Attributes:
        scenario: Preset of the simulated cell, or ``paper``.
        arm: ``zebra-zero`` or ``ur5``; empty takes that of ``settings``.
        settings: A TOML file of palpate with any other settings, such as a ``run.toml``.
        rig: Rig file; empty is the simulator.
        out: On a rig, the folder for palpate's own recording.
        seed: Seed of the trials.
        joints: Number of the arm's joints.
        decision_limit_s: On a rig, how long LeRobot may pause between two actions before the arm is stopped and the rig
            latched; until then the peg rests on the plate.
    """

    scenario: str = "paper"
    arm: str = ""
    settings: str = ""
    rig: str = ""
    out: str = ""
    seed: int = 0
    joints: int = 6
    decision_limit_s: float = 5.0
