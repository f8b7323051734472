"""The configuration for ``lerobot-record --robot.type=palpate``."""

from dataclasses import dataclass

from lerobot.robots import RobotConfig


@RobotConfig.register_subclass("palpate")
@dataclass(kw_only=True)
class PalpateConfig(RobotConfig):
    """Configuration of a simulated work cell or a rig.

    Attributes:
        scenario: Preset of the simulated cell, or ``paper``.
        arm: ``zebra-zero`` or ``ur5``; empty uses the arm specified in ``settings``.
        settings: A palpate TOML file with any other settings, such as a ``run.toml``.
        rig: Rig file; empty uses the simulator.
        out: Folder for palpate's own recording on a rig.
        seed: Random seed for the trials.
        joints: Number of joints of the arm.
        decision_limit_s: Maximum pause between two LeRobot actions on a rig. The peg rests on the plate during a pause.
            After a longer pause, the arm is stopped and the rig is latched.
    """

    scenario: str = "paper"
    arm: str = ""
    settings: str = ""
    rig: str = ""
    out: str = ""
    seed: int = 0
    joints: int = 6
    decision_limit_s: float = 5.0
